"""Serialized messages become columns: against rosbags' encoder and the .msg files."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_up_run import Encoder

from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import KEY_OF_MESSAGE_TYPE, TOPIC_TYPES, DecodeError
from maglev_monitor.metrics.decoding import decode, stamps
from maglev_monitor.metrics.derived import positions
from maglev_monitor.metrics.joiner import ROW
from maglev_monitor.metrics.run_metrics import LIMITS

KEYS = tuple(TOPIC_TYPES)


@pytest.mark.parametrize('key', KEYS)
def test_fields_are_those_of_the_message_file(key: str, encoder: Any) -> None:
    name = TOPIC_TYPES[key].message_type
    definition = encoder.store.types[name].__dataclass_fields__
    fields = [field for field in definition if not field.startswith('__') and field.islower()]
    assert fields == ['header', *(field.name for field in TOPIC_TYPES[key].fields)]


def test_phases_are_those_of_the_message_file(encoder: Any) -> None:
    reference = encoder.store.types['maglev_msgs/msg/Reference']
    for phase in Phase:
        assert getattr(reference, phase.name) == phase


def test_what_limits_currents_is_as_the_message_file_says(encoder: Any) -> None:
    state = encoder.store.types['maglev_msgs/msg/ControllerState']
    assert LIMITS == {'current': state.CURRENT, 'levitation': state.LEVITATION}


def test_columns_are_what_was_sent(run: Any, messages: dict[str, list[bytes]]) -> None:
    records = {key: decode(key, messages[key]) for key in KEYS}
    for key in KEYS:
        np.testing.assert_array_equal(records[key]['sequence'], np.arange(len(run)))
        np.testing.assert_array_equal(stamps(records[key]), run.stage_time)
    np.testing.assert_array_equal(records['measurement']['wall_time'], run.stamp)
    assert records['measurement']['lockstep'].all()
    np.testing.assert_array_equal(records['controller']['limited_by'], run.limited_by)
    np.testing.assert_array_equal(records['reference']['phase'], run.phase)
    np.testing.assert_array_equal(records['reference']['segment'], run.segment)
    np.testing.assert_array_equal(records['reference']['position'], run.reference)
    np.testing.assert_array_equal(records['reference']['target'], run.target)
    np.testing.assert_array_equal(records['measurement']['gap'], run.gap)
    np.testing.assert_array_equal(records['measurement']['z'], run.position[:, 2])
    np.testing.assert_array_equal(records['measurement']['late_samples'], run.late)
    np.testing.assert_array_equal(records['currents']['quadrature_current'], run.quadrature)
    np.testing.assert_array_equal(records['controller']['saturated'], run.saturated)
    np.testing.assert_array_equal(records['plant']['state'][:, 0:10:2], run.position)
    assert (records['plant']['thermal_load'] == 0.25).all()


def test_former_messages_lack_what_was_added(run: Any) -> None:
    former = Encoder(former=True)
    added_since = {
        'reference': {'session'},
        'measurement': {'wall_time', 'lockstep', 'controller'},
        'controller': {'limited_by'},
        'plant': {'own_length'},
    }
    for key, added in added_since.items():
        records = decode(key, [former.message(run, key, n) for n in range(3)])
        fields = {field.name for field in TOPIC_TYPES[key].fields}
        assert fields - set(records.dtype.names or ()) == added
        np.testing.assert_array_equal(stamps(records), run.stamp[:3])


def test_what_was_added_later_may_be_lacking_alone(run: Any, encoder: Any) -> None:
    now = decode('measurement', [encoder.message(run, 'measurement', 5)])
    lockstep = (now.dtype.fields or {})['lockstep'][1]
    before = encoder.message(run, 'measurement', 5)[: lockstep + 1]
    for padding in (b'', bytes(3)):
        records = decode('measurement', [before + padding])
        assert set(now.dtype.names or ()) - set(records.dtype.names or ()) == {'controller'}
        assert records['wall_time'] == now['wall_time']
        assert records['lockstep'] == now['lockstep']


def test_messages_before_and_after_a_field_was_added_do_not_mix(run: Any, encoder: Any) -> None:
    mixed = [source.message(run, 'controller', 0) for source in (encoder, Encoder(former=True))]
    with pytest.raises(DecodeError, match=r'not every .* has the same fields'):
        decode('controller', mixed)


@pytest.mark.parametrize('former', [False, True])
@pytest.mark.parametrize('key', KEYS)
def test_frame_id_may_have_any_length_and_change(key: str, former: bool, run: Any) -> None:
    encoder = Encoder(former=former)
    frames = ['', 'a', 'stage', 'stage', 'a_long_frame_of_the_stage', 'ü']
    sent = [encoder.message(run, key, n, frame) for n, frame in enumerate(frames)]
    plain = [encoder.message(run, key, n) for n in range(len(frames))]
    with_frames, without = decode(key, sent), decode(key, plain)
    assert with_frames.dtype.names == without.dtype.names
    for name in without.dtype.names or ():
        np.testing.assert_array_equal(with_frames[name], without[name])


@pytest.mark.parametrize('key', KEYS)
def test_no_messages_are_no_records(key: str) -> None:
    assert len(decode(key, [])) == 0


@pytest.mark.parametrize('key', KEYS)
@pytest.mark.parametrize('cut', [0, 3, 15, 40, -9, -1])
def test_a_message_cut_short_is_refused(
    key: str, cut: int, messages: dict[str, list[bytes]]
) -> None:
    good = messages[key][7]
    with pytest.raises(DecodeError, match=TOPIC_TYPES[key].message_type):
        decode(key, [good, good[:cut]])


def test_a_message_of_another_topic_is_refused(messages: dict[str, list[bytes]]) -> None:
    with pytest.raises(DecodeError, match='another version of maglev_msgs'):
        decode('reference', messages['measurement'][:3])


def test_big_endian_is_refused(messages: dict[str, list[bytes]]) -> None:
    message = b'\x00\x00' + messages['currents'][0][2:]
    with pytest.raises(DecodeError, match='little-endian'):
        decode('currents', [message])


def test_every_topic_is_found_by_its_message_type() -> None:
    assert {KEY_OF_MESSAGE_TYPE[topic.message_type] for topic in TOPIC_TYPES.values()} == set(KEYS)


tilts = st.floats(-0.5, 0.5)


@settings(max_examples=60)
@given(y=st.floats(0.01, 0.04), phi=tilts, theta=tilts, radius=st.floats(0.1, 1.0))
def test_outputs_invert_the_papers_5(y: float, phi: float, theta: float, radius: float) -> None:
    gap = [
        y - radius * np.sin(phi),
        y + radius * np.sin(theta),
        y + radius * np.sin(phi),
        y - radius * np.sin(theta),
    ]
    rows = np.zeros(1, ROW)
    rows['has_measurement'], rows['gap'], rows['x'], rows['z'] = True, gap, 0.01, -0.02
    found = positions(rows, radius)[:, 1]
    np.testing.assert_allclose(found, [[y, 0.01, -0.02, phi, theta]], rtol=0.0, atol=1e-12)
