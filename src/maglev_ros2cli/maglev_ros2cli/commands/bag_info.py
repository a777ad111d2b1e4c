"""``ros2 bag info``: what is in a bag."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from maglev_ros2cli.bags import add_bag_path, files, opened, storage
from maglev_ros2cli.parser import Verbs

_INDENT = 19
_UNITS = ('B', 'KiB', 'MiB', 'GiB', 'TiB')


def add(verbs: Verbs) -> None:
    verb = verbs.add('info', info, 'Print information about a bag to the screen')
    add_bag_path(verb)
    verb.flag('-t', '--topic-name', help='Only display topic names')


def info(arguments: Any) -> None:
    with opened(arguments.bag_path) as reader:
        if arguments.topic_name:
            lines = [connection.topic for connection in reader.connections]
        else:
            lines = list(_lines(reader, files(arguments.bag_path)))
    for line in lines:
        print(line)


def _lines(reader: Reader, paths: list[Path]) -> Iterator[str]:
    first = reader.start_time if reader.message_count else 0
    duration = reader.duration - 1 if reader.message_count else 0  # to after the last, for rosbags
    entries = {
        'Files:': [path.name for path in paths],
        'Bag size:': [size(sum(path.stat().st_size for path in paths))],
        'Storage id:': [storage(paths[0])],
        'ROS Distro:': [reader.ros_distro or 'unknown'],
        'Duration:': [f'{seconds(duration)}s'],
        'Start:': [moment(first)],
        'End:': [moment(first + duration)],
        'Messages:': [str(reader.message_count)],
        'Topic information:': [_topic(each) for each in reader.connections],
        'Service:': ['0'],
    }
    yield ''
    for title, values in entries.items():
        for number, value in enumerate(values):
            yield f'{"" if number else title:<{_INDENT}}{value}'
    yield 'Service information: '


def _topic(connection: Connection) -> str:
    form = getattr(connection.ext, 'serialization_format', 'cdr')
    return (
        f'Topic: {connection.topic} | Type: {connection.msgtype} | Count: {connection.msgcount}'
        f' | Serialization Format: {form}'
    )


def size(count: float) -> str:
    """A number of bytes in the largest unit that it reaches."""
    index = 0
    while count >= 1024 and index < len(_UNITS) - 1:
        count /= 1024
        index += 1
    return f'{count:.{1 if index else 0}f} {_UNITS[index]}'


def seconds(nanoseconds: int) -> str:
    """A time in seconds with all its digits."""
    whole, rest = divmod(nanoseconds, 1_000_000_000)
    return f'{whole}.{rest:09d}'


def moment(nanoseconds: int) -> str:
    """A time since the epoch, local and as a number."""
    whole, rest = divmod(nanoseconds, 1_000_000_000)
    local = time.strftime('%b %e %Y %H:%M:%S', time.localtime(whole))
    return f'{local}.{rest:09d} ({seconds(nanoseconds)})'
