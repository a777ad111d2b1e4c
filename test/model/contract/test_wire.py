"""Messages read and written in place; test/node/test_samples.py holds them against ROS's own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.contract.wire import TOPIC_TYPES, DecodeError, Field, Incoming, Outgoing

KEYS = tuple(TOPIC_TYPES)
NUMBERS: dict[str, st.SearchStrategy[Any]] = {
    '?': st.booleans(),
    '<u1': st.integers(0, 2**8 - 1),
    '<u4': st.integers(0, 2**32 - 1),
    '<u8': st.integers(0, 2**64 - 1),
    '<f8': st.floats(),
}
FRAMES = st.text(st.characters(blacklist_characters='\0', codec='utf-8'), max_size=20)


def values(field: Field) -> st.SearchStrategy[Any]:
    number = NUMBERS[field.kind]
    if field.length == 1:
        return number
    return st.lists(number, min_size=field.length, max_size=field.length)


def filled(key: str, frame: str = 'stage') -> Outgoing:
    """A message with a number of its own in each element."""
    message = Outgoing(key, frame)
    for number, field in enumerate(TOPIC_TYPES[key].fields):
        message[field.name] = np.arange(field.length) + number % 2
    message.set_stamp(1_790_000_000_123_456_789)
    return message


@pytest.mark.parametrize('key', KEYS)
@given(data=st.data(), stamp=st.integers(0, 2**31 * 10**9 - 1), frame=FRAMES)
def test_what_is_written_is_read(key: str, data: st.DataObject, stamp: int, frame: str) -> None:
    message = Outgoing(key, frame)
    sent = {field.name: data.draw(values(field)) for field in TOPIC_TYPES[key].fields}
    for name, value in sent.items():
        message[name] = value
    message.set_stamp(stamp)
    received = Incoming(key).read(message.serialized())
    assert received.stamp == stamp
    assert set(received._fields) == {'stamp', *sent}
    for name, value in sent.items():
        np.testing.assert_array_equal(getattr(received, name), value)


def test_numbers_are_pythons_own_and_arrays_copies_fit_for_compiled_code() -> None:
    message = filled('measurement')
    received = Incoming('measurement').read(message.serialized())
    assert {type(value) for value in received[:-1]} == {int, float, bool}
    gap = received.gap
    assert gap.flags.carray
    assert gap.dtype == np.float64


def test_what_is_not_written_again_stays() -> None:
    message = filled('currents')
    before = Incoming('currents').read(message.serialized())
    message['sequence'] = 7
    after = Incoming('currents').read(message.serialized())
    assert after.sequence == 7
    assert after._replace(sequence=before.sequence, direct_current=0, quadrature_current=0) == (
        before._replace(direct_current=0, quadrature_current=0)
    )
    np.testing.assert_array_equal(after.direct_current, before.direct_current)


def test_what_was_serialized_does_not_change_any_more() -> None:
    message = filled('currents')
    serialized = message.serialized()
    message['direct_current'] = np.ones(4)
    assert Incoming('currents').read(serialized).direct_current.tolist() == [1.0, 2.0, 3.0, 4.0]


def test_a_field_that_is_none_or_has_another_shape_is_refused() -> None:
    message = Outgoing('currents', 'stage')
    with pytest.raises(KeyError, match='gap'):
        message['gap'] = np.zeros(4)
    with pytest.raises(ValueError, match='shape'):
        message['direct_current'] = np.zeros(5)
    with pytest.raises(ValueError, match='shape'):
        message['sequence'] = np.zeros(4)


@pytest.mark.parametrize('key', KEYS)
def test_a_message_of_another_length_is_refused(key: str) -> None:
    incoming, good = Incoming(key), filled(key).serialized()
    incoming.read(good)
    for wrong in (good[:-1], good[:40], good[:15], b'', good + bytes(8)):
        with pytest.raises(DecodeError, match=f'{TOPIC_TYPES[key].message_type}'):
            incoming.read(wrong)
    assert incoming.read(good).stamp == 1_790_000_000_123_456_789


@pytest.mark.parametrize('key', KEYS)
def test_a_message_of_an_earlier_version_is_refused(key: str) -> None:
    fields = TOPIC_TYPES[key].fields
    added = sum(np.dtype(field.kind).itemsize * field.length for field in fields if field.added)
    with pytest.raises(DecodeError, match='version'):
        Incoming(key).read(filled(key).serialized()[:-added])


def test_a_big_endian_message_is_refused() -> None:
    good = filled('currents').serialized()
    incoming = Incoming('currents')
    incoming.read(good)
    with pytest.raises(DecodeError, match='little-endian'):
        incoming.read(b'\x00\x00' + good[2:])


def test_a_frame_that_claims_to_be_longer_is_refused() -> None:
    good = filled('currents').serialized()
    for length in (30, 200, 2**31, 2**32 - 1):
        with pytest.raises(DecodeError, match='Currents'):
            Incoming('currents').read(good[:12] + length.to_bytes(4, 'little') + good[16:])


def test_senders_with_ever_other_frames_take_no_more_memory() -> None:
    incoming = Incoming('currents')
    for length in range(300):
        assert incoming.read(filled('currents', 'f' * length).serialized()).session == 1
    assert len(incoming._parsers) <= 64
