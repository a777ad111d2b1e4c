"""Bags on disk and on the command line."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml
from rclpy.duration import Duration
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.interfaces import Qos, QosTime
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.errors import ReaderError

from maglev_ros2cli.parser import CommandError, Parser
from maglev_ros2cli.qos import POLICIES

STORAGES = {'.mcap': 'mcap', '.db3': 'sqlite3'}
"""Kinds of storage by the suffixes of their files."""

_TIMES = ('deadline', 'lifespan', 'liveliness_lease_duration')


def bag_path(text: str) -> Path:
    """An argument that names a bag, a folder or one of its files."""
    path = Path(text)
    if not path.exists():
        raise argparse.ArgumentTypeError(f"Bag path '{text}' does not exist!")
    return path


def add_bag_path(parser: Parser) -> None:
    """The arguments that say which bag is read."""
    parser.add_argument('bag_path', type=bag_path, help='Bag to open')
    parser.add_argument(
        '-s', '--storage', choices=sorted(STORAGES.values()), help='As ever: its suffix says it'
    )


def add_overrides(parser: Parser) -> None:
    """The option that names a file of QoS profiles."""
    parser.add_argument(
        '--qos-profile-overrides-path',
        type=Path,
        metavar='FILE',
        help='A yaml file with QoS profiles of topics',
    )


def storage(path: Path) -> str:
    """The kind of storage of a file, which may be compressed; empty for what is none."""
    return STORAGES.get(Path(path.name.removesuffix('.zstd')).suffix, '')


def files(path: Path) -> list[Path]:
    """The storage files of a bag, in order."""
    if path.is_file():
        return [path]
    found = [each for each in path.iterdir() if storage(each)]
    return sorted(found, key=lambda each: (len(each.name), each.name))


@contextlib.contextmanager
def opened(path: Path) -> Iterator[Reader]:
    """A bag to read. Raises :class:`CommandError` when it cannot be."""
    try:
        with Reader(path) as reader:
            yield reader
    except (ReaderError, OSError) as error:
        raise CommandError(
            f"cannot read the bag '{path}': {error}; what was cut off, \"ros2 run maglev_monitor"
            ' analyze" reads'
        ) from error


def profile(offered: Qos) -> QoSProfile:
    """A QoS profile of a bag, with a history that is known."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=max(offered.depth, 10),
        reliability=ReliabilityPolicy(int(offered.reliability.value)),
        durability=DurabilityPolicy(int(offered.durability.value)),
        deadline=_duration(offered.deadline),
        lifespan=_duration(offered.lifespan),
        liveliness=LivelinessPolicy(int(offered.liveliness.value)),
        liveliness_lease_duration=_duration(offered.liveliness_lease_duration),
    )


def _duration(time: QosTime) -> Duration:
    return Duration(seconds=time.sec, nanoseconds=time.nsec)


def overrides(path: Path | None) -> dict[str, QoSProfile]:
    """QoS profiles by topics from a file as rosbag2 reads it.

    Raises :class:`CommandError` when it cannot be read, or says what is none.
    """
    if path is None:
        return {}
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8')) or {}
        return {topic: _override(values) for topic, values in content.items()}
    except (OSError, yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise CommandError(f"[ERROR] [ros2bag]: QoS profiles in '{path}': {error!r}") from error


def _override(values: dict[str, Any]) -> QoSProfile:
    given: dict[str, Any] = {'history': HistoryPolicy.KEEP_LAST, 'depth': 10}
    for name, value in values.items():
        if name in POLICIES:
            given[name] = POLICIES[name].get_from_short_key(value)
        elif name in _TIMES:
            given[name] = Duration(seconds=value.get('sec', 0), nanoseconds=value.get('nsec', 0))
        else:
            given[name] = value
    return QoSProfile(**given)
