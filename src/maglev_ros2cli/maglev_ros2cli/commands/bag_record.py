"""``ros2 bag record``: write topics to a bag, with the writer of the project's recorder."""

from __future__ import annotations

import argparse
import contextlib
import re
import signal
import sys
import time
from pathlib import Path
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from maglev_model.programs.command import noted
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.recorder import bag_qos, message_folder
from maglev_monitor.bag.writer import BagWriter
from maglev_node.polling import PolledSubscription, PollingNode
from maglev_ros2cli import qos
from maglev_ros2cli.bags import add_overrides, overrides
from maglev_ros2cli.graph import absolute, add_arguments, discover, node, seen_topics, topics
from maglev_ros2cli.messages import find_type
from maglev_ros2cli.parser import CommandError, Verbs, complete

_POLL, _FLUSH = 0.05, 1.0
_DEPTH = 20000
"""How many messages of a topic may come between two looks."""


def add(verbs: Verbs) -> None:
    verb = verbs.add('record', record, 'Record ROS data to a bag')
    chosen = verb.add_argument('topics_positional', nargs='*', metavar='topic', help='To record')
    complete(chosen, seen_topics)
    verb.add_argument('--topics', nargs='+', default=[], metavar='TOPIC', help='To record')
    verb.flag('-a', '--all', help='Record all topics')
    verb.add_argument('--all-topics', dest='all', action='store_true', help='Record all topics')
    verb.add_argument('-e', '--regex', type=_expression, help='Topics that contain this expression')
    verb.add_argument('--exclude-regex', type=_expression, help='And leave out those with this one')
    verb.add_argument(
        '--exclude-topics', nargs='+', default=[], metavar='TOPIC', help='Leave these out'
    )
    verb.flag('--include-hidden-topics', help='Also hidden topics')
    verb.add_argument('-o', '--output', type=Path, help="The bag's folder, which is made")
    verb.add_argument('-s', '--storage', choices=['mcap'], default='mcap', help='Kind of storage')
    verb.flag('--no-discovery', help='Only topics there at the start')
    verb.add_argument('--node-name', default='rosbag2_recorder', help="The recorder's name")
    verb.flag('--disable-keyboard-controls', help='As ever: there are none')
    add_arguments(verb)
    add_overrides(verb)


def record(arguments: Any) -> None:
    arguments.topics = [absolute(each) for each in arguments.topics + arguments.topics_positional]
    if not (arguments.all or arguments.topics or arguments.regex):
        raise CommandError(
            '[ERROR] [ros2bag]: Need to specify at least one option out of --all, --topics, --regex'
        )
    output = arguments.output or Path(time.strftime('rosbag2_%Y_%m_%d-%H_%M_%S'))
    if output.exists():
        raise CommandError(f"[ERROR] [ros2bag]: Output folder '{output}' already exists.")
    writer = BagWriter(output, message_folder)
    with node(arguments.node_name) as own, noted(signal.SIGINT, signal.SIGTERM) as caught:
        recorder = _Recorder(own, writer, arguments, caught)
        try:
            with contextlib.closing(writer):
                writer.open()
                own.get_logger().info('Listening for topics...')
                discover(own, arguments.spin_time)
                recorder.run()
        except BagError as error:
            raise CommandError(f'[ERROR] [ros2bag]: {error}') from error
        own.get_logger().info('Recording stopped')
    if signal.SIGTERM in caught:
        sys.exit(128 + signal.SIGTERM)


class _Recorder:
    """The subscriptions of a recording, and what they bring."""

    def __init__(
        self, own: PollingNode, writer: BagWriter, arguments: Any, caught: list[int]
    ) -> None:
        self._own = own
        self._writer = writer
        self._arguments = arguments
        self._caught = caught
        self._overrides = overrides(arguments.qos_profile_overrides_path)
        self._taps: dict[str, PolledSubscription] = {}
        self._ignored: set[str] = set()

    def run(self) -> None:
        """Write what comes, until a signal; what is there then is written still."""
        self._subscribe()
        self._own.get_logger().info('Recording...')
        flushed = time.monotonic()
        while not self._caught:
            time.sleep(_POLL)
            if not self._arguments.no_discovery:
                self._subscribe()
            if time.monotonic() - flushed >= _FLUSH:
                flushed = time.monotonic()
                self._writer.flush()
            self._take()

    def _take(self) -> None:
        for topic, tap in self._taps.items():
            self._writer.write(topic, tap.take())

    def _subscribe(self) -> None:
        """To what is published since the last time and wanted."""
        for topic, types in topics(self._own).items():
            if topic in self._taps or topic in self._ignored or not self._wanted(topic):
                continue
            offers = [info.qos_profile for info in self._own.get_publishers_info_by_topic(topic)]
            if not offers:
                continue
            try:
                kind = find_type(types[0], 'msg')
                self._writer.add_topic(topic, types[0], list(dict.fromkeys(map(bag_qos, offers))))
            except (CommandError, BagError) as error:
                self._ignored.add(topic)
                self._own.get_logger().warning(f"Topic '{topic}' is left out: {error}")
                continue
            self._taps[topic] = self._own.poll(topic, kind, self._profile(topic), raw=True)
            self._own.get_logger().info(f"Subscribed to topic '{topic}'")

    def _profile(self, topic: str) -> QoSProfile:
        if topic in self._overrides:
            return self._overrides[topic]
        return qos.matching(self._own, topic, QoSProfile(depth=_DEPTH))

    def _wanted(self, topic: str) -> bool:
        given = self._arguments
        if topic in given.topics:
            return True
        if topic_or_service_is_hidden(topic) and not given.include_hidden_topics:
            return False
        if topic in given.exclude_topics:
            return False
        if given.exclude_regex and given.exclude_regex.search(topic):
            return False
        return bool(given.all or (given.regex and given.regex.search(topic)))


def _expression(text: str) -> re.Pattern[str]:
    try:
        return re.compile(text)
    except re.error as error:
        raise argparse.ArgumentTypeError(f"'{text}' is no expression: {error}") from error
