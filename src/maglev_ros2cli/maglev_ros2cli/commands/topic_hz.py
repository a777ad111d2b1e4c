"""``ros2 topic hz``: how often the messages of a topic come."""

from __future__ import annotations

import collections
import statistics
import time
from typing import Any

from maglev_model.programs.arguments import whole_number
from maglev_ros2cli import qos
from maglev_ros2cli.commands.topic_echo import the_type
from maglev_ros2cli.graph import absolute, add_arguments, add_topic_name, graph, topics, wait_until
from maglev_ros2cli.messages import find_type
from maglev_ros2cli.parser import Verbs

_WINDOW = 10000
_DEPTH = 20000
_POLL, _REPORT = 0.02, 1.0
"""How often is looked, and how often told [s]."""


def add(verbs: Verbs) -> None:
    verb = verbs.add('hz', hz, 'Print the average receiving rate to screen')
    add_arguments(verb)
    add_topic_name(verb, "Name of the ROS topic to listen to (e.g. '/chatter')")
    size = f'window size, in # of messages, for calculating rate (default: {_WINDOW})'
    verb.add_argument('-w', '--window', type=whole_number(1), default=_WINDOW, help=size)
    verb.flag('--wall-time', help='As ever: wall time is what counts')
    qos.add_arguments(verb, 'sensor_data')


def hz(arguments: Any) -> None:
    """Print rate and intervals once a second, by the times of reception."""
    topic = absolute(arguments.topic_name)
    with graph(arguments, lambda own: own.count_publishers(topic)) as own:
        if topic not in topics(own):
            print(f'WARNING: topic [{topic}] does not appear to be published yet')
            wait_until(lambda: topic in topics(own))
        profile = qos.to_hear(own, topic, arguments, _DEPTH)
        tap = own.poll(topic, find_type(the_type(own, topic), 'msg'), profile, raw=True)
        intervals: collections.deque[float] = collections.deque(maxlen=arguments.window)
        last, told, fresh = 0, time.monotonic(), False
        while True:
            for _, received in tap.take():
                if last:
                    intervals.append((received - last) * 1e-9)
                last, fresh = received, True
            if time.monotonic() - told >= _REPORT:
                told = time.monotonic()
                if fresh and intervals:
                    print(summary(intervals))
                fresh = False
            time.sleep(_POLL)


def summary(intervals: collections.abc.Sequence[float]) -> str:
    """Rate, shortest and longest interval, their standard deviation and number."""
    mean = statistics.fmean(intervals)
    rate = 1.0 / mean if mean > 0.0 else 0.0
    return (
        f'average rate: {rate:.3f}\n\tmin: {min(intervals):.3f}s max: {max(intervals):.3f}s'
        f' std dev: {statistics.pstdev(intervals):.5f}s window: {len(intervals)}'
    )
