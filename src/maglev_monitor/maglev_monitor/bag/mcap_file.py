"""Read an mcap file from front to back, also one that was cut off. No ROS here.

A recorder that was killed leaves no footer and no index, perhaps half a chunk. Chunks need neither:
they are read in the order they were written, up to the last whole message.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from rosbags.rosbag2.storage_mcap import decompress

MAGIC = b'\x89MCAP0\r\n'

_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x02, 0x03, 0x04, 0x05, 0x06
_RECORD = struct.Struct('<BQ')
_MESSAGE_HEAD = struct.Struct('<HIQQ')
_CHUNK_HEAD = struct.Struct('<QQQI')
_LARGEST_RECORD = 1 << 32  # a length beyond this is damage, not data [bytes]


class McapError(ValueError):
    """The file is no mcap file."""


class Message(NamedTuple):
    """One message of a file: topic, message type, time of reception [ns] and serialized content."""

    topic: str
    message_type: str
    time: int
    data: bytes


class McapFile:
    """An mcap file that is read from front to back.

    After :meth:`chunks` is exhausted, ``complete`` tells whether the file ended as it should, and
    ``damage`` what was wrong otherwise.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete = False
        self.damage = ''
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}

    def chunks(self) -> Iterator[list[Message]]:
        """Messages in the order they were written, chunk by chunk.

        Raises :class:`McapError` when the file is no mcap file, OSError when it cannot be read.
        """
        self.complete, self.damage = False, ''
        with self.path.open('rb') as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise McapError(f"'{self.path}' is no mcap file")
            while True:
                opcode, content, whole = _read_record(file)
                if opcode == _FOOTER and whole:
                    self.complete = True
                    return
                if opcode == _CHUNK:
                    messages = self._chunk(content, whole)
                    if messages:
                        yield messages
                elif whole and opcode is not None:
                    message = self._record(opcode, content, 0, len(content))
                    if message is not None:
                        yield [message]
                if not whole:
                    self.damage = self.damage or 'it was cut off'
                if self.damage:
                    return

    def _chunk(self, content: bytes, whole: bool) -> list[Message]:
        """Messages of a chunk; of one that is cut off or damaged, those that can be had."""
        if len(content) < _CHUNK_HEAD.size + 4:
            return []
        _, _, size, crc = _CHUNK_HEAD.unpack_from(content)
        name_end = _CHUNK_HEAD.size + 4 + int.from_bytes(content[28:32], 'little')
        compression = content[_CHUNK_HEAD.size + 4 : name_end].decode('ascii', 'replace')
        records = content[name_end + 8 :]
        if whole:
            try:
                records = decompress(records, compression, size, crc)
            except Exception as error:  # each decompressor has errors of its own
                self.damage = f'a chunk is damaged ({error})'
                return []
        elif compression:
            return []
        return self._messages(records)

    def _messages(self, records: bytes) -> list[Message]:
        found = []
        position, end = 0, len(records)
        while position + _RECORD.size <= end:
            opcode, length = _RECORD.unpack_from(records, position)
            start = position + _RECORD.size
            position = start + length
            if position > end:
                break
            message = self._record(opcode, records, start, position)
            if message is not None:
                found.append(message)
        return found

    def _record(self, opcode: int, data: bytes, start: int, end: int) -> Message | None:
        """Take one record; a message is returned, schemas and channels are remembered."""
        if opcode == _MESSAGE:
            channel, _, time, _ = _MESSAGE_HEAD.unpack_from(data, start)
            topic, message_type = self._channels.get(channel, ('', ''))
            return Message(topic, message_type, time, data[start + _MESSAGE_HEAD.size : end])
        if opcode == _SCHEMA:
            number = int.from_bytes(data[start : start + 2], 'little')
            self._schemas[number], _ = _string(data, start + 2)
        elif opcode == _CHANNEL:
            number, schema = struct.unpack_from('<HH', data, start)
            topic, _ = _string(data, start + 4)
            self._channels[number] = (topic, self._schemas.get(schema, ''))
        return None


def _string(data: bytes, start: int) -> tuple[str, int]:
    end = start + 4 + int.from_bytes(data[start : start + 4], 'little')
    return data[start + 4 : end].decode('utf-8', 'replace'), end


def _read_record(file: BinaryIO) -> tuple[int | None, bytes, bool]:
    """Opcode, content and whether the record is whole; no opcode at the end of the file."""
    head = file.read(_RECORD.size)
    if len(head) < _RECORD.size:
        return None, b'', False
    opcode, length = _RECORD.unpack(head)
    if length > _LARGEST_RECORD:
        return None, b'', False
    content = file.read(length)
    return opcode, content, len(content) == length
