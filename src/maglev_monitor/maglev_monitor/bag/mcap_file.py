"""Read an mcap file from front to back, also one that was cut off. No ROS here.

A recorder that was killed leaves no footer and no index, perhaps half a chunk. Chunks need neither:
they are read in the order they were written, up to the last whole one, and of half a chunk that is
not compressed up to the last whole message.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, InvalidMagic, RecordLengthLimitExceeded
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk, read_magic

_CUT_OFF = (EndOfFile, RecordLengthLimitExceeded, InvalidMagic, struct.error, UnicodeDecodeError)


class NoMcapError(ValueError):
    """The file is no mcap file."""


class TopicMessages(NamedTuple):
    """Messages of one topic in the order they were written: topic, message type, serialized."""

    topic: str
    message_type: str
    data: list[bytes]


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

    def chunks(self) -> Iterator[list[TopicMessages]]:
        """Messages by topic, chunk by chunk in the order they were written.

        Raises :class:`NoMcapError` when the file is no mcap file, OSError when it cannot be read.
        """
        self.complete, self.damage = False, ''
        with self.path.open('rb') as file:
            for records in self._records(file):
                messages = self._messages(records)
                if messages:
                    yield messages

    def _records(self, file: BinaryIO) -> Iterator[list[McapRecord]]:
        """The records of each chunk, and those outside of chunks one by one."""
        try:
            read_magic(ReadDataStream(file))
        except _CUT_OFF as error:
            raise NoMcapError(f"'{self.path}' is no mcap file") from error
        whole = file.tell()
        try:
            for record in StreamReader(file, skip_magic=True, emit_chunks=True).records:
                whole = file.tell()
                self.complete |= isinstance(record, Footer)
                records = self._broken_up(record) if isinstance(record, Chunk) else [record]
                yield records
                if self.damage:
                    return
        except _CUT_OFF:
            if not self.complete:
                self.damage = 'it was cut off'
                file.seek(whole)
                yield _front_of_chunk(file)

    def _broken_up(self, chunk: Chunk) -> list[McapRecord]:
        try:
            return breakup_chunk(chunk, validate_crc=True)
        except Exception as error:  # each decompressor has errors of its own
            self.damage = f'a chunk is damaged ({error})'
            return []

    def _messages(self, records: list[McapRecord]) -> list[TopicMessages]:
        """Group the messages among records; schemas and channels are remembered."""
        by_channel: dict[int, list[bytes]] = {}
        for record in records:
            if isinstance(record, Message):
                by_channel.setdefault(record.channel_id, []).append(record.data)
            elif isinstance(record, Channel):
                self._channels[record.id] = (record.topic, self._schemas.get(record.schema_id, ''))
            elif isinstance(record, Schema):
                self._schemas[record.id] = record.name
        return [
            TopicMessages(*self._channels.get(channel, ('', '')), data)
            for channel, data in by_channel.items()
        ]


def _front_of_chunk(file: BinaryIO) -> list[McapRecord]:
    """The whole records of half a chunk; none of a compressed one."""
    records: list[McapRecord] = []
    with contextlib.suppress(*_CUT_OFF):
        stream = ReadDataStream(file)
        opcode, _length = stream.read1(), stream.read8()
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(stream)
            if not chunk.compression:
                for record in StreamReader(BytesIO(chunk.data), skip_magic=True).records:
                    records.append(record)
    return records
