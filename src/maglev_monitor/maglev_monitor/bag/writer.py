"""Write a run's bag: mcap, raw messages, with definitions and QoS. No ROS here."""

from __future__ import annotations

import contextlib
import shutil
from collections import defaultdict
from collections.abc import Callable, Sequence
from io import BufferedWriter, BytesIO
from pathlib import Path
from typing import Any, cast

from rosbags.interfaces import Connection, Qos
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.errors import WriterError
from rosbags.rosbag2.storage_mcap import McapWriter, PendingChunk
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

_CHUNK_BYTES = 1 << 19  # below rosbags' own 1 MiB, so that chunks are closed here
_SPARE_BYTES = 4 << 20  # room that must be left for index and metadata

FindMessages = Callable[[str], Path]
"""From a package's name to the folder of its .msg files; raises LookupError."""


class BagError(RuntimeError):
    """The bag cannot be written or read; the message says why and what to do."""


class BagWriter:
    """A bag that is being written. What has been flushed survives a kill.

    :param path: folder of the bag, made by :meth:`open`; must not exist.
    :param find_messages: where the .msg files of packages lie that are not ROS's own.
    :param compress: compress the chunks with zstd.
    """

    def __init__(self, path: Path, find_messages: FindMessages, *, compress: bool = False) -> None:
        self.path = path
        self.counts: dict[str, int] = {}
        self._find_messages = find_messages
        self._compress = compress
        self._typestore: Typestore = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {}
        self._writer: Writer | None = None
        self._whole: tuple[int, dict[int, int], dict[int, int]] = (0, {}, {})

    def open(self) -> None:
        """Make the bag. Raises :class:`BagError` when it exists or cannot be written."""
        if self.path.exists():
            raise BagError(f"'{self.path}' exists already: give another output folder")
        try:
            writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
            if self._compress:
                writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
            writer.open()
            self._writer = writer
            self._unbuffer()
        except (OSError, WriterError) as error:
            raise self._cannot_write(error) from error

    def know(self, message_type: str) -> None:
        """Make a message type known, from ROS's own store or from .msg files.

        Raises :class:`BagError` when there is no definition of it.
        """
        if message_type in self._typestore.types:
            return
        package = message_type.split('/')[0]
        types: dict[str, Any] = {}
        try:
            for file in sorted(self._find_messages(package).glob('*.msg')):
                name = f'{package}/msg/{file.stem}'
                if name not in self._typestore.types:
                    types.update(get_types_from_msg(file.read_text(encoding='utf-8'), name))
            self._typestore.register(types)
        except (OSError, LookupError) as error:
            raise BagError(f"no definition of '{message_type}' found: {_reason(error)}") from error
        if message_type not in self._typestore.types:
            raise BagError(f"no definition of '{message_type}' found in package '{package}'")

    def add_topic(self, topic: str, message_type: str, qos: Sequence[Qos] = ()) -> None:
        """Add a topic with its message definition; unknown ones raise :class:`BagError`."""
        assert self._writer is not None
        self.know(message_type)
        self._connections[topic] = self._writer.add_connection(
            topic, message_type, typestore=self._typestore, offered_qos_profiles=qos
        )
        self.counts[topic] = 0

    def write(self, topic: str, time: int, data: bytes) -> None:
        """Write a serialized message received at a time [ns]. Raises :class:`BagError`."""
        assert self._writer is not None
        self._writer.write(self._connections[topic], time, data)
        self.counts[topic] += 1
        if self._storage().chunk.bio.tell() > _CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Hand what was written over to the system, so that it survives a kill.

        Raises :class:`BagError`, also when the disk is nearly full: the bag can still be closed
        then.
        """
        storage = self._storage()
        try:
            if storage.chunk.msgs:
                storage.close_chunk()
            self._remember()
            free = shutil.disk_usage(self.path).free
        except OSError as error:
            self._go_back()
            raise self._cannot_write(error) from error
        if free < _SPARE_BYTES:
            raise BagError(f"cannot write the bag '{self.path}': the disk is full")

    def close(self) -> None:
        """Finish the bag with index and metadata; may be called twice.

        Raises :class:`BagError` when that fails; what was flushed can still be analysed.
        """
        writer = self._writer
        if writer is None:
            return
        try:
            storage = self._storage()
            if storage.chunk.msgs:
                storage.close_chunk()
            if not any(writer.counts.values()):
                writer.min_timestamp = 0
            writer.close()
        except OSError as error:
            with contextlib.suppress(OSError):
                self._go_back()
                writer.abort()
            raise BagError(
                f"cannot finish the bag '{self.path}': {_reason(error)}; analyze can recover it"
            ) from error
        finally:
            self._writer = None

    def _unbuffer(self) -> None:
        """Write chunks straight to the file: a buffer would write what failed once more, later."""
        storage = self._storage()
        storage.bio.close()
        storage.bio = cast(BufferedWriter, storage.path.open('r+b', buffering=0))
        storage.bio.seek(0, 2)
        self._remember()

    def _remember(self) -> None:
        """The file is whole up to here."""
        assert self._writer is not None
        storage = self._storage()
        self._whole = (storage.bio.tell(), dict(self._writer.counts), dict(storage.channel_stats))

    def _go_back(self) -> None:
        """Forget what could not be written, so that the bag can be closed as it was before."""
        assert self._writer is not None
        storage = self._storage()
        position, counts, channel_stats = self._whole
        storage.bio.truncate(position)
        storage.bio.seek(position)
        storage.chunk = PendingChunk(2**63 - 1, 0, BytesIO(), defaultdict(list))
        self._writer.counts.update(counts)
        storage.channel_stats.update(channel_stats)

    def _cannot_write(self, error: Exception) -> BagError:
        return BagError(f"cannot write the bag '{self.path}': {_reason(error)}")

    def _storage(self) -> McapWriter:
        assert self._writer is not None
        return cast(McapWriter, self._writer.storage)


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return str(error)
