"""The messages of the sample topics in their serialized form: where each field lies. No ROS here.

Plain CDR, little endian, as every middleware of ROS 2 sends it (DDSI-RTPS 10; OMG CDR 9.3): behind
four octets of encapsulation each number stands at a multiple of its own size. But for the header's
``frame_id`` all is of fixed size, so that a message is read and written in place, without building
a message object, which costs more than the control law does.
"""

from __future__ import annotations

import struct
from collections import namedtuple
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class DecodeError(ValueError):
    """A serialized message is not what its topic's type says."""


class Field(NamedTuple):
    """One field behind the header: its name, its NumPy type and its number of elements."""

    name: str
    kind: str
    length: int = 1
    added: int = 0  # at the end of the message, with which change; bags from before lack it


class TopicType(NamedTuple):
    """One topic of a run: its message type and the fields behind the header."""

    message_type: str
    fields: tuple[Field, ...]


HARDWARE_ID = 'maglev_stage'
"""``hardware_id`` of what the nodes say on ``diagnostics``; others may speak there of their own."""

TOPIC_TYPES = {
    'reference': TopicType(
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
    'measurement': TopicType(
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
    'currents': TopicType(
        'maglev_msgs/msg/Currents',
        (
            Field('sequence', '<u8'),
            Field('direct_current', '<f8', 4),
            Field('quadrature_current', '<f8', 4),
            Field('session', '<u8', added=1),
            Field('status', '<u1', added=1),
        ),
    ),
    'controller': TopicType(
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
    'plant': TopicType(
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
}
"""The topics of a run by key: reference, measurement, currents, controller, plant."""

KEY_OF_MESSAGE_TYPE = {topic.message_type: key for key, topic in TOPIC_TYPES.items()}

PROGRESS_SUFFIX = '/progress'
"""How the names of topics end that repeat a part of another's messages."""

KEPT = {'lockstep': 16384, 'realtime': 4096}
"""Samples that a publisher keeps for readers that are busy, by mode.

Seconds in both. A reader that has gone without a word, or was stopped, acknowledges none of them,
and the more there are, the longer takes a publish, whose time in real time is short.
"""

_ENCAPSULATION = b'\x00\x01\x00\x00'  # plain CDR, little endian
_FRAME_ID_LENGTH = slice(12, 16)
_STRUCT_CODES = {'i4': 'i', 'u1': 'B', 'u4': 'I', 'u8': 'Q', 'f8': 'd', 'b1': '?'}
_SECOND = 1_000_000_000  # [ns]
_MOST_KINDS = 64  # of senders, by frame_id and version, whose messages are read at once
_named_tuple: Callable[..., Any] = namedtuple


def record_type(key: str, message: bytes) -> np.dtype[np.void]:
    """Where the fields of a message lie, and its stamp as ``seconds`` and ``nanoseconds``.

    :param key: key of the topic in :data:`TOPIC_TYPES`.
    :param message: one serialized message.
    :raises DecodeError: when it is too short, too long or not plain little-endian CDR.
    """
    if message[:2] != _ENCAPSULATION[:2]:
        raise DecodeError(
            f'a {TOPIC_TYPES[key].message_type} is encoded as {message[:2].hex()}, '
            'only plain little-endian CDR (0001) is read'
        )
    return _record_type(key, int.from_bytes(message[_FRAME_ID_LENGTH], 'little'), len(message))


def no_record_type(key: str) -> np.dtype[np.void]:
    """As :func:`record_type` where there is no message."""
    return _record_type(key, 1, _offsets(TOPIC_TYPES[key].fields, 1)[1])


class Incoming:
    """Reads the messages of one topic, one at a time.

    :param key: key of the topic in :data:`TOPIC_TYPES`.
    """

    def __init__(self, key: str) -> None:
        self._key = key
        self._parsers: dict[tuple[int, bytes, bytes], Callable[[bytes], Any]] = {}

    def read(self, message: bytes) -> Any:
        """A named tuple of ``stamp`` [ns since the epoch] and the message's fields.

        Numbers are Python's own, arrays copies. Raises DecodeError as :func:`record_type`.
        """
        kind = len(message), message[:2], message[_FRAME_ID_LENGTH]
        parse = self._parsers.get(kind)
        if parse is None:
            if len(self._parsers) >= _MOST_KINDS:
                self._parsers.clear()
            parse = self._parsers[kind] = self._parser(message)
        return parse(message)

    def _parser(self, message: bytes) -> Callable[[bytes], Any]:
        record = record_type(self._key, message)
        assert record.fields is not None
        if len(record.fields) < len(TOPIC_TYPES[self._key].fields) + 2:
            raise DecodeError(f'a {TOPIC_TYPES[self._key].message_type} is of an earlier version')
        numbers, arrays, layout, position = [], [], '<', 0
        for name, (kind, offset, *_) in record.fields.items():
            if kind.shape:
                arrays.append((name, kind.base, kind.shape[0], offset))
                continue
            numbers.append(name)
            layout += f'{offset - position}x{_STRUCT_CODES[kind.str[1:]]}'
            position = offset + kind.itemsize
        unpack = struct.Struct(f'{layout}{len(message) - position}x').unpack
        parts = [each[1:] for each in arrays]
        names = ['stamp', *numbers[2:], *(each[0] for each in arrays)]
        received = _named_tuple('Received', names)

        def parse(message: bytes) -> Any:
            seconds, nanoseconds, *values = unpack(message)
            for kind, length, offset in parts:
                values.append(np.frombuffer(message, kind, length, offset).copy())
            return received(seconds * _SECOND + nanoseconds, *values)

        return parse


class Outgoing:
    """One message of a topic, whose fields are written in place and keep what they have.

    :param key: key of the topic in :data:`TOPIC_TYPES`.
    :param frame_id: of its header.
    """

    def __init__(self, key: str, frame_id: str) -> None:
        frame = frame_id.encode() + b'\0'
        size = _offsets(TOPIC_TYPES[key].fields, len(frame))[1]
        head = _ENCAPSULATION + bytes(8) + len(frame).to_bytes(4, 'little') + frame
        self._octets = bytearray(head.ljust(size, b'\0'))
        record = np.frombuffer(self._octets, record_type(key, bytes(self._octets)))
        self._fields = {name: record[name] for name in record.dtype.names or ()}

    def __setitem__(self, name: str, value: ArrayLike) -> None:
        """Write a field. Raises KeyError for none of the message's, ValueError for the shape."""
        self._fields[name][...] = value

    def set_stamp(self, nanoseconds: int) -> None:
        """Write the header's stamp [ns since the epoch]."""
        self['seconds'], self['nanoseconds'] = divmod(nanoseconds, _SECOND)

    def serialized(self) -> bytes:
        """The message as it is now."""
        return bytes(self._octets)


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
