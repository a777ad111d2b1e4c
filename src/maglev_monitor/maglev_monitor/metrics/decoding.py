"""The five topics of a run as columns: serialized messages in, NumPy records out.

A block of serialized messages of one topic is decoded at once, without building a message object
for each: the fields behind the header lie at fixed offsets (plain CDR, little endian), so a block
is one structured array. A live monitor and the analysis of a bag both read through here. No ROS
here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Records = NDArray[np.void]


class DecodeError(ValueError):
    """A serialized message is not what its topic's type says."""


class Field(NamedTuple):
    """One field behind the header: its name, its NumPy type and its number of elements."""

    name: str
    kind: str
    length: int = 1
    added: int = 0  # at the end of the message, with which change; bags from before lack it


class TopicType(NamedTuple):
    """One topic of a run: a short key, its message type and the fields behind the header."""

    key: str
    message_type: str
    fields: tuple[Field, ...]


TOPIC_TYPES = {
    topic.key: topic
    for topic in (
        TopicType(
            'reference',
            'maglev_msgs/msg/Reference',
            (
                Field('sequence', '<u8'),
                Field('phase', '<u1'),
                Field('segment', '<u4'),
                Field('position', '<f8', 5),
                Field('velocity', '<f8', 5),
                Field('acceleration', '<f8', 5),
                Field('target', '<f8', 5),
                Field('session', '<u8', added=1),
            ),
        ),
        TopicType(
            'measurement',
            'maglev_msgs/msg/Measurement',
            (
                Field('sequence', '<u8'),
                Field('gap', '<f8', 4),
                Field('x', '<f8'),
                Field('z', '<f8'),
                Field('late_samples', '<u8'),
                Field('wall_time', '<u8', added=1),
                Field('lockstep', '?', added=1),
                Field('controller', '<u8', added=2),
            ),
        ),
        TopicType(
            'currents',
            'maglev_msgs/msg/Currents',
            (
                Field('sequence', '<u8'),
                Field('direct_current', '<f8', 4),
                Field('quadrature_current', '<f8', 4),
                Field('session', '<u8', added=1),
                Field('status', '<u1', added=1),
            ),
        ),
        TopicType(
            'controller',
            'maglev_msgs/msg/ControllerState',
            (
                Field('sequence', '<u8'),
                Field('mode', '<u1'),
                Field('saturated', '?'),
                Field('position', '<f8', 5),
                Field('error', '<f8', 5),
                Field('error_rate', '<f8', 5),
                Field('virtual_input', '<f8', 5),
                Field('internal_model', '<f8', 5),
                Field('limited_by', '<u1', added=1),
            ),
        ),
        TopicType(
            'plant',
            'maglev_msgs/msg/PlantState',
            (
                Field('sequence', '<u8'),
                Field('state', '<f8', 10),
                Field('direct_current', '<f8', 4),
                Field('quadrature_current', '<f8', 4),
                Field('thermal_load', '<f8', 4),
                Field('own_length', '<f8', 6, added=1),
            ),
        ),
    )
}
"""The topics of a run by key: reference, measurement, currents, controller, plant."""

KEY_OF_MESSAGE_TYPE = {topic.message_type: key for key, topic in TOPIC_TYPES.items()}

_ENCAPSULATION = b'\x00\x01\x00\x00'  # plain CDR, little endian
_FRAME_ID_LENGTH = slice(12, 16)


def decode(key: str, messages: Sequence[bytes]) -> Records:
    """Decode serialized messages of one topic.

    :param key: key of the topic in :data:`TOPIC_TYPES`.
    :param messages: the serialized messages, in order of arrival.
    :returns: records, shape (n,): the message's fields, and its stamp as ``seconds`` and
        ``nanoseconds``.
    :raises DecodeError: when a message is too short, too long or not plain little-endian CDR.
    """
    if not messages:
        return np.zeros(0, _record_type(key, 1, _size(key, 1)))
    first = messages[0]
    uniform = all(len(message) == len(first) for message in messages)
    if uniform:
        octets = np.frombuffer(b''.join(messages), np.uint8).reshape(len(messages), -1)
        if octets.shape[1] >= _FRAME_ID_LENGTH.stop:
            lengths = octets[:, _FRAME_ID_LENGTH]
            if (lengths == lengths[0]).all() and (octets[:, 1] == first[1]).all():
                record_type = _record_type(key, _frame_id_length(key, first), len(first))
                return octets.view(record_type)[:, 0]
    if len(messages) == 1:
        raise DecodeError(f'a message of {len(first)} bytes is no {TOPIC_TYPES[key].message_type}')
    parts = [decode(key, [message]) for message in messages]
    names = parts[0].dtype.names or ()
    if any(part.dtype.names != names for part in parts):
        raise DecodeError(f'not every {TOPIC_TYPES[key].message_type} has the same fields')
    joined = np.zeros(len(parts), [(name, parts[0].dtype[name]) for name in names])
    for index, part in enumerate(parts):
        for name in names:
            joined[name][index] = part[name][0]
    return joined


def stamps(records: Records) -> NDArray[np.int64]:
    """Header stamps of decoded records [ns], shape (n,)."""
    seconds = records['seconds'].astype(np.int64)
    nanoseconds: NDArray[np.int64] = seconds * 1_000_000_000 + records['nanoseconds']
    return nanoseconds


def _frame_id_length(key: str, message: bytes) -> int:
    if message[:2] != _ENCAPSULATION[:2]:
        raise DecodeError(
            f'a {TOPIC_TYPES[key].message_type} is encoded as {message[:2].hex()}, '
            'only plain little-endian CDR (0001) is read'
        )
    return int.from_bytes(message[_FRAME_ID_LENGTH], 'little')


def _offsets(fields: Sequence[Field], frame_id_length: int) -> tuple[list[int], int]:
    """Offsets of the fields from the start of the serialized message, and its size [bytes]."""
    position = 12 + frame_id_length
    offsets = []
    for field in fields:
        item = np.dtype(field.kind).itemsize
        position += -position % item
        offsets.append(position + len(_ENCAPSULATION))
        position += item * field.length
    return offsets, position + len(_ENCAPSULATION)


def _size(key: str, frame_id_length: int) -> int:
    return _offsets(TOPIC_TYPES[key].fields, frame_id_length)[1]


def _record_type(key: str, frame_id_length: int, size: int) -> np.dtype[np.void]:
    fields: Sequence[Field] = TOPIC_TYPES[key].fields
    offsets, needed = _offsets(fields, frame_id_length)
    while size < needed and fields[-1].added:
        newest = fields[-1].added
        fields = [field for field in fields if field.added < newest]
        offsets, needed = _offsets(fields, frame_id_length)
    if not needed <= size < needed + 8:
        raise DecodeError(
            f'a {TOPIC_TYPES[key].message_type} has {size} bytes instead of {needed}: '
            'was it recorded with another version of maglev_msgs?'
        )
    formats = [
        (field.kind, (field.length,)) if field.length > 1 else field.kind for field in fields
    ]
    return np.dtype(
        {
            'names': ['seconds', 'nanoseconds', *(field.name for field in fields)],
            'formats': ['<i4', '<u4', *formats],
            'offsets': [4, 8, *offsets],
            'itemsize': size,
        }
    )
