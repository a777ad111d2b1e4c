"""``ros2 bag play``: publish what is in a bag."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosgraph_msgs.msg import Clock

from maglev_model.programs.arguments import not_negative, positive
from maglev_node.leaving import deliver
from maglev_node.polling import PollingNode
from maglev_node.stamp import set_stamp
from maglev_ros2cli.bags import add_bag_path, add_overrides, opened, overrides, profile
from maglev_ros2cli.graph import discover, node
from maglev_ros2cli.messages import find_type
from maglev_ros2cli.parser import CommandError, Verbs

_CLOCK_RATE = 40.0
_UNKNOWN_QOS = 10  # messages, where nobody tells what the publishers offered


def add(verbs: Verbs) -> None:
    verb = verbs.add('play', play, 'Play back ROS data from a bag')
    add_bag_path(verb)
    verb.add_argument('-r', '--rate', type=positive, default=1.0, help='Rate at which to play')
    verb.flag('-l', '--loop', help='Play again when it has ended')
    verb.add_argument('--topics', nargs='+', metavar='TOPIC', help='To replay (default: all)')
    verb.add_argument('-m', '--remap', nargs='+', default=[], metavar='OLD:=NEW', help='New names')
    add = verb.add_argument
    clock = f'Publish to /clock at a rate, by default {_CLOCK_RATE:g} Hz'
    add('--clock', type=positive, nargs='?', const=_CLOCK_RATE, metavar='HZ', help=clock)
    add('-d', '--delay', type=not_negative, default=0.0, help='Sleep SEC before play')
    start = 'Start from this many seconds into the bag'
    add('--start-offset', type=not_negative, default=0.0, help=start)
    verb.flag('--disable-keyboard-controls', help='As ever: there are none')
    add_overrides(verb)


def play(arguments: Any) -> None:
    """Publish to the end of the bag, again and again with ``--loop``, or until interrupted."""
    with opened(arguments.bag_path) as reader, node('rosbag2_player') as own:
        own.get_logger().info(f'Set rate to {arguments.rate:g}')
        player = _Player(own, reader, arguments)
        discover(own)  # so that subscribers have the first message
        time.sleep(arguments.delay)
        try:
            player.play()
            while arguments.loop:
                player.play()
            player.deliver()
        except KeyboardInterrupt:
            own.get_logger().info('Stopping playback.')


class _Player:
    """The publishers for a bag."""

    def __init__(self, own: PollingNode, reader: Reader, arguments: Any) -> None:
        self._reader = reader
        self._rate = arguments.rate
        self._start = reader.start_time + int(arguments.start_offset * 1e9)
        self._publishers = {}
        renamed = _renamed(arguments.remap)
        given = overrides(arguments.qos_profile_overrides_path)
        for connection in reader.connections:
            topic = connection.topic
            if arguments.topics and topic not in arguments.topics:
                continue
            try:
                kind = find_type(connection.msgtype, 'msg')
            except CommandError as error:
                own.get_logger().warning(f"Ignoring a topic '{topic}', reason: {error}")
                continue
            offered = getattr(connection.ext, 'offered_qos_profiles', ())
            recorded = profile(offered[0]) if offered else _UNKNOWN_QOS
            qos = given.get(topic, recorded)
            name = renamed.get(topic, topic)
            self._publishers[connection.id] = own.create_publisher(kind, name, qos)
        self._period = 1.0 / arguments.clock if arguments.clock else math.inf
        self._ticked = 0.0
        self._clock = own.create_publisher(Clock, '/clock', 10) if arguments.clock else None

    def play(self) -> None:
        """Publish each message at its time."""
        wall = time.monotonic()
        for connection, stamp, data in self._messages():
            self._wait(wall, stamp)
            self._publishers[connection.id].publish(bytes(data))

    def deliver(self) -> None:
        """Give the last messages the time to arrive."""
        deliver(self._publishers.values())

    def _messages(self) -> Iterator[tuple[Connection, int, bytes]]:
        played = [each for each in self._reader.connections if each.id in self._publishers]
        return self._reader.messages(played, start=self._start) if played else iter(())

    def _wait(self, wall: float, stamp: int) -> None:
        """Wait for the time of a message, by a steady clock; publish ``/clock`` meanwhile."""
        due = wall + (stamp - self._start) * 1e-9 / self._rate
        while True:
            now = time.monotonic()
            if self._clock is not None and now - self._ticked >= self._period:
                self._ticked, message = now, Clock()
                set_stamp(message.clock, self._start + int((now - wall) * 1e9 * self._rate))
                self._clock.publish(message)
            if now >= due:
                return
            time.sleep(min(due - now, self._period))


def _renamed(rules: list[str]) -> dict[str, str]:
    names = {}
    for rule in rules:
        old, sign, new = rule.partition(':=')
        if not (old and sign and new):
            raise CommandError(f"[ERROR] [ros2bag]: '{rule}' is no rule OLD:=NEW")
        names[old] = new
    return names
