"""``ros2 topic pub``: publish messages given as YAML."""

from __future__ import annotations

import time
from typing import Any

from maglev_model.programs.arguments import count, not_negative, positive
from maglev_node.leaving import deliver
from maglev_ros2cli import qos
from maglev_ros2cli.graph import absolute, add_arguments, add_topic_name, node
from maglev_ros2cli.interfaces import names
from maglev_ros2cli.messages import fill, find_type, values_of
from maglev_ros2cli.parser import CommandError, Verbs, complete

_SAY_WAITING = 1.0


def add(verbs: Verbs) -> None:
    verb = verbs.add('pub', pub, 'Publish a message to a topic')
    add_arguments(verb)
    add_topic_name(verb, "Name of the ROS topic to publish to (e.g. '/chatter')")
    add = verb.add_argument
    kind = add('message_type', help="Type of the message ('std_msgs/msg/String')")
    complete(kind, lambda _: names('msg'))
    add('values', nargs='?', default='{}', help="Values in YAML ('data: Hello World')")
    add('-r', '--rate', metavar='N', type=positive, default=1.0, help='Rate in Hz')
    add('-p', '--print', metavar='N', type=count, default=1, help='Only print every N-th message')
    times = verb.add_mutually_exclusive_group()
    times.add_argument('-1', '--once', action='store_true', help='Publish one message and exit')
    times.add_argument(
        '-t', '--times', metavar='N', type=count, default=0, help='Publish N times and then exit'
    )
    first = 'Wait for N subscriptions first (default: 1 with --once or --times, otherwise 0)'
    add('-w', '--wait-matching-subscriptions', metavar='N', type=count, help=first)
    most = 'Wait for them at most S seconds'
    add('--max-wait-time-secs', metavar='S', type=not_negative, help=most)
    stay = 'Stay for S seconds at the end'
    add('--keep-alive', metavar='S', type=not_negative, default=0.1, help=stay)
    add('-n', '--node-name', help='Name of the created publishing node')
    qos.add_arguments(verb, 'default')


def pub(arguments: Any) -> None:
    """Publish until interrupted, or as often as is asked for."""
    kind = find_type(arguments.message_type, 'msg')
    message = kind()
    stampers = fill(message, values_of(arguments.values))
    times = 1 if arguments.once else arguments.times
    with node(arguments.node_name) as own:
        publisher = own.create_publisher(kind, absolute(arguments.topic_name), qos.asked(arguments))
        wanted = arguments.wait_matching_subscriptions
        _wait(publisher, min(times, 1) if wanted is None else wanted, arguments.max_wait_time_secs)
        print('publisher: beginning loop')
        start, count = time.monotonic(), 0
        while not times or count < times:
            time.sleep(max(0.0, start + count / arguments.rate - time.monotonic()))
            count += 1
            for stamp in stampers:
                stamp(own.get_clock().now().to_msg())
            if arguments.print and count % arguments.print == 0:
                print(f'publishing #{count}: {message!r}\n')
            publisher.publish(message)
        deliver([publisher])
        time.sleep(arguments.keep_alive)


def _wait(publisher: Any, wanted: int, timeout: float | None) -> None:
    start = time.monotonic()
    said = start - _SAY_WAITING
    while publisher.get_subscription_count() < wanted:
        now = time.monotonic()
        if timeout is not None and now - start >= timeout:
            raise CommandError(f'Timed out waiting for subscribers: Expected {wanted}')
        if now - said >= _SAY_WAITING:
            said = now
            print(f'Waiting for at least {wanted} matching subscription(s)...')
        time.sleep(0.01)
