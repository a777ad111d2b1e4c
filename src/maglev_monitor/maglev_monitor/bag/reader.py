"""Read a bag into what the metrics take, whole or cut off. No ROS here."""

from __future__ import annotations

import dataclasses
import itertools
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml
import zstandard
from numpy.typing import NDArray
from rosbags.rosbag2 import Reader
from rosbags.serde.errors import SerdeError
from rosbags.typesys import Stores, get_typestore

from maglev_model.contract.wire import HARDWARE_ID, KEY_OF_MESSAGE_TYPE, PROGRESS_SUFFIX
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.mcap_file import MAGIC_BYTES, McapFile, TopicMessages
from maglev_monitor.metrics.decoding import Records, decode

_DIAGNOSTICS = 'diagnostic_msgs/msg/DiagnosticArray'
_READER_BATCH = 5000  # messages handed on at once when rosbags reads
_STORAGES = ('.mcap', '.db3')
_COMPRESSED = b'\x28\xb5\x2f\xfd'  # how it begins; no CDR does


class Diagnostic(NamedTuple):
    """One status of /diagnostics: its stamp [ns], level (REP-107), node, message and values."""

    stamp: int
    level: int
    name: str
    message: str
    values: dict[str, str]


@dataclasses.dataclass
class Batch:
    """Consecutive messages of a bag: decoded samples by topic key, and diagnostics."""

    samples: dict[str, Records]
    diagnostics: list[Diagnostic]


class Bag:
    """A bag that is read from front to back.

    :param path: folder of a run, folder of a bag, or one file of a bag.
    :param progress: is told of each batch how much of the files has been read.
    :raises BagError: when there is no bag at ``path``.

    After :meth:`batches` is exhausted, ``notes`` says in plain lines what was wrong with the bag,
    and ``counts`` holds the messages read by topic.
    """

    def __init__(self, path: Path, progress: Progress | None = None) -> None:
        self.path, self.files = _find(path)
        self._progress = progress
        self.notes: list[str] = []
        self.counts: dict[str, int] = {}
        self._topics: dict[str, str] = {}  # by key
        self._newest = -1  # number of the last sample that was measured
        self._typestore = get_typestore(Stores.ROS2_JAZZY)

    def custom(self) -> dict[str, str]:
        """What the bag says of itself besides, by name; nothing where it is cut off."""
        found = (self._information() or {}).get('custom_data')
        if not isinstance(found, dict):
            return {}
        return {str(name): str(value) for name, value in found.items() if value}

    def _information(self) -> dict[str, Any] | None:
        """What rosbag2 wrote of the bag; None where there is nothing that can be read."""
        folder = self.path.parent if self.path.is_file() else self.path
        try:
            text = (folder / 'metadata.yaml').read_text(encoding='utf-8', errors='replace')
            loader = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
            found = yaml.load(text, loader)['rosbag2_bagfile_information']
        except (OSError, yaml.YAMLError, ValueError, KeyError, TypeError):
            return None
        return found if isinstance(found, dict) else None

    def batches(self) -> Iterator[Batch]:
        """The bag's content in the order it was written. Raises :class:`BagError`."""
        self.counts = {}
        self.notes.clear()
        self._newest = -1
        try:
            for messages in map(_decompressed, self._read()):
                for topic, _, data in messages:
                    self.counts[topic] = self.counts.get(topic, 0) + len(data)
                yield self._batch(messages)
        except (OSError, ValueError, SerdeError, zstandard.ZstdError) as error:
            raise self._unreadable(error) from error
        finally:
            if self._progress:
                self._progress.end()
        if not self.counts:
            raise BagError(f"the bag '{self.path}' holds no message")

    def _unreadable(self, error: Exception) -> BagError:
        return BagError(f"cannot read the bag '{self.path}': {error}")

    def _read(self) -> Iterator[list[TopicMessages]]:
        if any(_plain(path).suffix != '.mcap' for path in self.files):
            yield from self._read_by_rosbags()
            return
        sizes = [path.stat().st_size for path in self.files]
        for number, path in enumerate(self.files):
            if number and sizes[number] < MAGIC_BYTES:
                self.notes.append(f"'{path.name}' is empty, it was cut off where it began")
                continue
            file = McapFile(path)
            recovered = 0
            for messages in file.chunks():
                recovered += sum(len(topic.data) for topic in messages)
                if self._progress:
                    read = sum(sizes[:number]) + round(file.share * sizes[number])
                    self._progress.tell(read, sum(sizes))
                yield messages
            if not file.complete:
                self.notes.append(
                    f"'{path.name}' is not whole, {file.damage}: {recovered} messages recovered"
                )
            elif number == 0 and self.path.is_dir() and self._information() is None:
                self.notes.append(self._without_metadata())
        if self._progress:
            self._progress.tell(1, 1)  # what is no message lies behind them

    def _without_metadata(self) -> str:
        there = (self.path / 'metadata.yaml').is_file()
        which = 'a metadata.yaml that cannot be read' if there else 'no metadata.yaml'
        return f"'{self.path}' has {which}: read without it"

    def _read_by_rosbags(self) -> Iterator[list[TopicMessages]]:
        whole = self.path.is_file() or (self.path / 'metadata.yaml').is_file()
        if not whole:
            self.notes.append(self._without_metadata())
        for path in [self.path] if whole else self.files:
            yield from self._read_one_by_rosbags(path)

    def _read_one_by_rosbags(self, path: Path) -> Iterator[list[TopicMessages]]:
        try:
            with Reader(path) as reader:
                messages = reader.messages()
                while batch := list(itertools.islice(messages, _READER_BATCH)):
                    by_topic: dict[tuple[str, str], list[bytes]] = {}
                    for connection, _, data in batch:
                        topic = (connection.topic, connection.msgtype)
                        by_topic.setdefault(topic, []).append(bytes(data))
                    yield [TopicMessages(*topic, data) for topic, data in by_topic.items()]
        except Exception as error:  # storages and decompressors have errors of their own
            raise self._unreadable(error) from error

    def _batch(self, messages: Sequence[TopicMessages]) -> Batch:
        serialized: defaultdict[str, list[bytes]] = defaultdict(list)
        diagnostics: list[Diagnostic] = []
        for topic, message_type, data in messages:
            key = KEY_OF_MESSAGE_TYPE.get(message_type)
            if key is not None and not topic.endswith(PROGRESS_SUFFIX):
                self._only(key, topic)
                serialized[key] += data
            elif message_type == _DIAGNOSTICS:
                for message in data:
                    diagnostics += self._diagnostics(message)
        samples = {key: decode(key, data) for key, data in serialized.items()}
        if 'measurement' in samples:
            self._check_order(samples['measurement']['sequence'].astype(np.int64))
        return Batch(samples, diagnostics)

    def _only(self, key: str, topic: str) -> None:
        known = self._topics.setdefault(key, topic)
        if topic != known:
            raise BagError(
                f"the bag '{self.path}' holds more than one run, '{known}' and '{topic}': record"
                ' each in a bag of its own'
            )

    def _check_order(self, numbers: NDArray[np.int64]) -> None:
        """A stage numbers its samples upwards until it is started again."""
        if np.any(np.diff(numbers, prepend=self._newest) < 0):
            raise BagError(
                f"the bag '{self.path}' holds several runs, whose samples have the same numbers:"
                ' record each in a bag of its own'
            )
        self._newest = int(numbers[-1])

    def _diagnostics(self, data: bytes) -> list[Diagnostic]:
        array: Any = self._typestore.deserialize_cdr(data, _DIAGNOSTICS)
        stamp = array.header.stamp.sec * 1_000_000_000 + array.header.stamp.nanosec
        return [
            Diagnostic(
                stamp,
                int(status.level),
                status.name,
                status.message,
                {pair.key: pair.value for pair in status.values},
            )
            for status in array.status
            if status.hardware_id == HARDWARE_ID
        ]


def run_folder(bag: Path) -> Path:
    """The folder of the run whose folder, bag or bag's file this is: its pages lie there.

    A file that lies in no bag is a run in the folder that it lies in.
    """
    bag = bag.resolve()
    if bag.is_file():
        bag = bag.parent
        if bag.name != 'bag' and not (bag / 'metadata.yaml').is_file():
            return bag
    return bag if (bag / 'bag').is_dir() else bag.parent


def _find(path: Path) -> tuple[Path, list[Path]]:
    """The bag that is meant by a path, and its files in order."""
    if not path.exists():
        raise BagError(f"there is no bag '{path}'")
    if path.is_file():
        if path.name == 'metadata.yaml':
            return _find(path.parent)
        if _plain(path).suffix not in _STORAGES:
            raise BagError(f"'{path}' is no bag: expected a folder, a .mcap or a .db3 file")
        return path, [path]
    for folder in (path, path / 'bag'):
        found = {path for path in folder.glob('*') if _plain(path).suffix in _STORAGES}
        files = [path for path in found if path == _plain(path) or _plain(path) not in found]
        if files:
            return folder, sorted(files, key=_natural)
    raise BagError(f"there is no bag in '{path}': no .mcap and no .db3 file")


def _natural(path: Path) -> tuple[int, str]:
    """Order of a bag's files: name_2 comes before name_10."""
    number = _plain(path).stem.rsplit('_', 1)[-1]
    return (int(number) if number.isdigit() else -1, path.name)


def _plain(path: Path) -> Path:
    """What a file is called where rosbag2 has not compressed it as a whole."""
    return path.with_suffix('') if path.suffix == '.zstd' else path


def _decompressed(messages: Sequence[TopicMessages]) -> list[TopicMessages]:
    """Messages, also those that rosbag2 compressed one by one."""
    whole = zstandard.ZstdDecompressor()
    return [
        each._replace(data=[whole.decompress(data) for data in each.data])
        if each.data[0].startswith(_COMPRESSED)
        else each
        for each in messages
    ]
