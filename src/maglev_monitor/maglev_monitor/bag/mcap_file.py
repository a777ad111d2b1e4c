"""Read an mcap file from front to back, also one that was cut off. No ROS here.

A recorder that was killed leaves no footer and no index, perhaps half a chunk. Chunks need neither:
they are read in the order they were written, up to the last whole one, and of half a chunk that is
not compressed up to the last whole message. What rosbag2 compressed as a whole is read alike.
"""

from __future__ import annotations

import contextlib
import struct
import tempfile
from collections.abc import Iterator
from io import SEEK_END, BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, InvalidMagic, RecordLengthLimitExceeded
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream, read_magic

_CUT_OFF = (
    EndOfFile,
    InvalidMagic,
    RecordLengthLimitExceeded,
    MemoryError,
    OverflowError,
    UnicodeDecodeError,
    struct.error,
)
MAGIC_BYTES = 8
"""What an mcap file begins with."""
_MESSAGE_HEAD_BYTES = 22  # channel, sequence, time of reception and of publication


class NoMcapError(ValueError):
    """The file is no mcap file."""


class TopicMessages(NamedTuple):
    """Messages of one topic in the order they were written: topic, message type, serialized."""

    topic: str
    message_type: str
    data: list[bytes]


class McapFile:
    """An mcap file that is read from front to back.

    ``share`` is how much of it has been read, 0 to 1. After :meth:`chunks` is exhausted,
    ``complete`` tells whether the file ended as it should, and ``damage`` what was wrong otherwise.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.complete = False
        self.damage = ''
        self.share = 0.0
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}
        self._messages: dict[int, list[bytes]] = {}  # by channel, since they were handed out

    def chunks(self) -> Iterator[list[TopicMessages]]:
        """Messages by topic, chunk by chunk in the order they were written.

        Raises :class:`NoMcapError` when the file is no mcap file, OSError when it cannot be read.
        """
        self.complete, self.damage = False, ''
        with self._opened() as file:
            size = file.seek(0, SEEK_END)
            file.seek(0)
            try:
                read_magic(ReadDataStream(file))
            except _CUT_OFF as error:
                raise NoMcapError(f"'{self.path}' is no mcap file") from error
            for record in self._records(file):
                self.share = file.tell() / size
                if isinstance(record, Chunk):
                    self._break_up(record)
                else:
                    self._take(record)
                if self._messages:
                    yield [
                        TopicMessages(*self._channels.get(channel, ('', '')), data)
                        for channel, data in self._messages.items()
                    ]
                    self._messages = {}
                if self.damage:
                    return

    @contextlib.contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        """The file; of one that is compressed as a whole, what of it can be decompressed."""
        with self.path.open('rb') as file:
            if self.path.suffix != '.zstd':
                yield file
                return
            with tempfile.TemporaryFile() as plain:
                with contextlib.suppress(zstandard.ZstdError):
                    zstandard.ZstdDecompressor().copy_stream(file, plain)
                yield plain

    def _records(self, file: BinaryIO) -> Iterator[McapRecord]:
        """Whole records, and at last what there is of a chunk that was cut off."""
        whole = file.tell()
        try:
            for record in StreamReader(file, skip_magic=True, emit_chunks=True).records:
                whole = file.tell()
                self.complete |= isinstance(record, Footer)
                yield record
        except _CUT_OFF:
            if self.complete:
                return
            self.damage = 'it was cut off'
        file.seek(whole)
        with contextlib.suppress(*_CUT_OFF):
            stream = ReadDataStream(file)
            opcode, _length = stream.read1(), stream.read8()
            if opcode == Opcode.CHUNK:
                yield Chunk.read(stream)

    def _break_up(self, chunk: Chunk) -> None:
        if self.damage:  # it was cut off
            if not chunk.compression:
                with contextlib.suppress(*_CUT_OFF):
                    self._take_all(ReadDataStream(BytesIO(chunk.data)), len(chunk.data))
            return
        try:
            self._take_all(*get_chunk_data_stream(chunk, validate_crc=True))
        except Exception as error:  # each decompressor has errors of its own
            self.damage = f'a chunk is damaged ({error})'

    def _take_all(self, stream: ReadDataStream, size: int) -> None:
        """Take the records of a chunk.

        As breakup_chunk of the library does, but without an object for each message, which costs
        three times as much.
        """
        messages = self._messages
        while stream.count < size:
            opcode, length = stream.read1(), stream.read8()
            if opcode == Opcode.MESSAGE:
                channel = stream.read2()
                stream.read(_MESSAGE_HEAD_BYTES - 2)
                data = stream.read(length - _MESSAGE_HEAD_BYTES)
                if len(data) == length - _MESSAGE_HEAD_BYTES:
                    messages.setdefault(channel, []).append(data)
            elif opcode == Opcode.CHANNEL:
                self._take(Channel.read(stream))
            elif opcode == Opcode.SCHEMA:
                self._take(Schema.read(stream))
            else:
                stream.read(length)

    def _take(self, record: McapRecord) -> None:
        if isinstance(record, Message):
            self._messages.setdefault(record.channel_id, []).append(record.data)
        elif isinstance(record, Channel):
            self._channels[record.id] = (record.topic, self._schemas.get(record.schema_id, ''))
        elif isinstance(record, Schema):
            self._schemas[record.id] = record.name
