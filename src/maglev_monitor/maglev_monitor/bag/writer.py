"""Write a run's bag: mcap, raw messages, with definitions and QoS. No ROS here."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, cast

from mcap.writer import CompressionType, Writer
from rosbags.interfaces import Qos

from maglev_monitor.bag.chunk_file import ChunkFile
from maglev_monitor.bag.definitions import Definitions, FindMessages
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.rosbag2_metadata import Span, Topic, as_yaml, bag_information, offered_qos
from maglev_monitor.metrics.result_file import write_whole

_CHUNK_BYTES = 1 << 19
_CHUNKS_IN_FILE = 1 << 11  # whose index the writer holds, half a kilobyte each; 11 min of a run
_SPARE_BYTES = 4 << 20  # what must be left on the disk, for other files as well
_INDEX_BYTES = 1 << 16  # more than schemas, channels and metadata take at the end of a bag
_INDEX_BYTES_PER_CHUNK = 1 << 9


class BagWriter:
    """A bag that is being written. What has been flushed survives a kill.

    A long one goes on in a further file, as rosbag2's do, so that memory does not grow with it.

    :param path: folder of the bag, made by :meth:`open`; must not exist.
    :param find_messages: where the .msg files of packages lie that are not ROS's own.
    :param compress: compress the chunks with zstd.
    :param custom: what else the bag shall say of itself, by name.
    """

    def __init__(
        self,
        path: Path,
        find_messages: FindMessages,
        *,
        compress: bool = False,
        custom: Mapping[str, str] | None = None,
    ) -> None:
        self.path = path
        self._custom = custom or {}
        self._compression = CompressionType.ZSTD if compress else CompressionType.NONE
        self._definitions = Definitions(find_messages)
        self._schemas: dict[str, int] = {}
        self._topics: dict[str, Topic] = {}
        self._files: dict[str, Span] = {}
        self._chunks = 0  # of the file
        self._span = Span()  # of the file
        self._file: ChunkFile | None = None
        self._mcap: Writer | None = None

    @property
    def counts(self) -> dict[str, int]:
        """Messages by topic."""
        return {topic.name: topic.count for topic in self._topics.values()}

    def open(self) -> None:
        """Make the bag. Raises :class:`BagError` when it exists or cannot be written."""
        if self.path.exists():
            raise BagError(f"'{self.path}' exists already: give another output folder")
        try:
            self.path.mkdir(parents=True)
            self._begin_file()
        except OSError as error:
            raise self._cannot_write(error) from error
        self._keep()

    def know(self, message_type: str) -> None:
        """Make sure that a message type is known. Raises :class:`BagError` when it is not."""
        self._definitions.of(message_type)

    def add_topic(self, topic: str, message_type: str, qos: Sequence[Qos] = ()) -> None:
        """Add a topic with its message definition; unknown ones raise :class:`BagError`."""
        type_hash = self._definitions.of(message_type).type_hash
        channel = self._register(topic, message_type, qos)
        self._topics[topic] = Topic(topic, message_type, type_hash, qos, channel)

    def write(self, topic: str, messages: Iterable[tuple[bytes, int]]) -> None:
        """Write serialized messages of a topic, each with its time in the bag [ns].

        Raises :class:`BagError`, as :meth:`flush`.
        """
        assert self._mcap is not None
        assert self._file is not None
        file, add_message = self._file, self._mcap.add_message
        channel = self._topics[topic].channel
        span = self._span
        count, first, last = 0, span.first, span.last
        try:
            for data, time in messages:
                add_message(channel, time, data, time)
                count += 1
                if time < first:
                    first = time
                if time > last:
                    last = time
                if file.position != file.whole:
                    self._keep()
        except OSError as error:
            raise self._break_off(error) from error
        finally:
            self._topics[topic].count += count
            span.count, span.first, span.last = span.count + count, first, last

    def flush(self) -> None:
        """Hand what was written over to the system, so that it survives a kill.

        Raises :class:`BagError`, also when the disk is nearly full: the bag can still be closed
        then.
        """
        assert self._mcap is not None
        try:
            self._mcap.flush()  # type: ignore[no-untyped-call]
        except OSError as error:
            raise self._break_off(error) from error
        self._keep()
        if self._chunks >= _CHUNKS_IN_FILE:
            self._change_files()

    def close(self) -> None:
        """Finish the bag with index and metadata; may be called twice.

        Raises :class:`BagError` when that fails; what was flushed can still be analysed.
        """
        file, self._file = self._file, None
        if file is None:
            return
        try:
            self._finish(file)
            self._write_metadata()
        except OSError as error:
            with contextlib.suppress(OSError):
                file.go_back()
            raise BagError(
                f"cannot finish the bag '{self.path}': {_reason(error)}; analyze can recover it"
            ) from error
        finally:
            self._mcap = None
            file.close()

    def _finish(self, file: ChunkFile) -> None:
        if self._mcap is None:
            raise OSError(errno.EIO, 'a part of it could not be written')
        self._mcap.flush()  # type: ignore[no-untyped-call]
        file.keep()
        self._mcap.add_metadata('rosbag2', {'serialized_metadata': as_yaml(self._information())})
        self._mcap.finish()  # type: ignore[no-untyped-call]

    def _write_metadata(self) -> None:
        text = as_yaml({'rosbag2_bagfile_information': self._information()}) + '\n'
        write_whole(self.path / 'metadata.yaml', text)

    def _information(self) -> dict[str, Any]:
        return bag_information(self._files, list(self._topics.values()), self._custom)

    def _begin_file(self) -> None:
        """Begin the next file, with the topics that are known."""
        name = f'{self.path.name}_{len(self._files)}.mcap'
        self._file = ChunkFile(self.path / name)
        self._mcap = Writer(
            cast(IO[bytes], self._file),
            chunk_size=_CHUNK_BYTES,
            compression=self._compression,
        )
        self._mcap.start('ros2')
        self._files[name] = self._span = Span()
        self._chunks = 0
        self._schemas.clear()
        for topic in self._topics.values():
            topic.channel = self._register(topic.name, topic.message_type, topic.qos)

    def _register(self, topic: str, message_type: str, qos: Sequence[Qos]) -> int:
        """Tell the file of a topic; its channel there."""
        assert self._mcap is not None
        if message_type not in self._schemas:
            text = self._definitions.of(message_type).text.encode()
            self._schemas[message_type] = self._mcap.register_schema(message_type, 'ros2msg', text)
        offered = {'offered_qos_profiles': offered_qos(qos)}
        return self._mcap.register_channel(topic, 'cdr', self._schemas[message_type], offered)

    def _change_files(self) -> None:
        """Finish the file and go on in the next."""
        assert self._file is not None
        full = self._file
        try:
            self._finish(full)
            full.keep()
            self._begin_file()
            full.close()
        except OSError as error:
            raise self._break_off(error) from error
        self._keep()

    def _keep(self) -> None:
        """The file is whole up to here. Is there room for the next chunk and the index?"""
        assert self._file is not None
        self._file.keep()
        self._chunks += 1
        index = _INDEX_BYTES + _INDEX_BYTES_PER_CHUNK * self._chunks
        if not self._file.may_grow(_CHUNK_BYTES * 5 // 4 + index):  # with the chunk's own index
            raise self._cannot_write(OSError(errno.EFBIG, os.strerror(errno.EFBIG)))
        try:
            free = shutil.disk_usage(self.path).free
        except OSError as error:
            raise self._cannot_write(error) from error
        if free < _SPARE_BYTES:
            raise BagError(f"cannot write the bag '{self.path}': the disk is full")

    def _break_off(self, error: OSError) -> BagError:
        """End the file where it was whole: what failed is lost, and the index with it."""
        assert self._file is not None
        self._mcap = None
        with contextlib.suppress(OSError):
            self._file.go_back()
        return self._cannot_write(error)

    def _cannot_write(self, error: OSError) -> BagError:
        return BagError(f"cannot write the bag '{self.path}': {_reason(error)}")


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()
