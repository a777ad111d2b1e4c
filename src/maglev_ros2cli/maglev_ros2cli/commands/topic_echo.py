"""``ros2 topic echo``: print the messages of a topic."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Any

from maglev_model.programs.arguments import count, not_negative
from maglev_node.polling import PollingNode
from maglev_ros2cli import qos
from maglev_ros2cli.graph import absolute, add_arguments, add_topic_name, graph, topics
from maglev_ros2cli.messages import Form, as_csv, as_yaml, find_type
from maglev_ros2cli.parser import CommandError, Verbs

_TRUNCATE = 128
_POLL = 0.01
_DEPTH = 1000
"""How many messages may come between two looks."""


def add(verbs: Verbs) -> None:
    verb = verbs.add('echo', echo, 'Output messages from a topic')
    add_arguments(verb)
    add_topic_name(verb, "Name of the ROS topic to listen to (e.g. '/chatter')")
    verb.add_argument('message_type', nargs='?', help="Type of the message ('std_msgs/msg/String')")
    qos.add_arguments(verb, 'sensor_data')
    verb.flag('--csv', help='All values separated by commas')
    verb.add_argument('--field', help="Echo a selected field; '.' for fields of fields")
    verb.flag('-f', '--full-length', help='All elements of arrays and strings')
    length = f'Length to truncate arrays, bytes and strings to (default: {_TRUNCATE})'
    verb.add_argument('-l', '--truncate-length', type=count, default=_TRUNCATE, help=length)
    verb.flag('--no-arr', help="Don't print array fields")
    verb.flag('--no-str', help="Don't print string fields")
    verb.flag('--flow-style', help='Print in the block style or flow')
    verb.flag('--no-lost-messages', help='As ever: none are reported')
    verb.flag('--raw', help='Echo the raw binary representation')
    verb.add_argument('--filter', metavar='EXPR', help="Only messages for which EXPR of 'm' holds")
    verb.flag('--once', help='Print the first message, then exit')
    verb.add_argument('--timeout', metavar='N', type=not_negative, help='Exit after N seconds')


def echo(arguments: Any) -> None:
    """Print messages until interrupted, the first one came or time is over."""
    form = Form(
        truncate=None if arguments.full_length else arguments.truncate_length,
        no_arrays=arguments.no_arr,
        no_strings=arguments.no_str,
        flow=arguments.flow_style,
    )
    wanted = _filter(arguments.filter)
    topic = absolute(arguments.topic_name)
    with graph(arguments, lambda own: own.count_publishers(topic)) as own:
        kind = find_type(arguments.message_type or the_type(own, topic), 'msg')
        for message in heard(own, topic, kind, arguments):
            if arguments.raw:
                print(message, end='\n---\n')
            else:
                part = _part(message, arguments.field)
                if not wanted(part):
                    continue
                _print(part, arguments.csv, form)
            if arguments.once:
                return


def the_type(own: PollingNode, topic: str) -> str:
    """The type of a topic's messages. Raises :class:`CommandError` when there is not one."""
    types = topics(own).get(topic)
    if not types:
        print(f'WARNING: topic [{topic}] does not appear to be published yet')
        raise CommandError('Could not determine the type for the passed topic')
    if len(types) > 1:
        raise CommandError(
            f"Cannot echo topic '{topic}', as it contains more than one type: [{', '.join(types)}]"
        )
    return types[0]


def heard(own: PollingNode, topic: str, kind: type, arguments: Any) -> Iterator[Any]:
    """Messages of a topic, until time is over."""
    tap = own.poll(topic, kind, qos.to_hear(own, topic, arguments, _DEPTH), raw=arguments.raw)
    end = math.inf if arguments.timeout is None else time.monotonic() + arguments.timeout
    while time.monotonic() < end:
        for message, _ in tap.take():
            yield message
        time.sleep(_POLL)


def _print(part: Any, csv: bool, form: Form) -> None:
    if not hasattr(part, 'get_fields_and_field_types'):
        print(part, end='\n---\n')
    elif csv:
        print(as_csv(part, form))
    else:
        print(as_yaml(part, form), end='---\n')


def _part(message: Any, field: str | None) -> Any:
    for name in field.split('.') if field else ():
        try:
            message = getattr(message, name)
        except AttributeError as error:
            raise CommandError(f"Invalid field '{field}': {error}") from error
    return message


def _filter(expression: str | None) -> Callable[[Any], bool]:
    if expression is None:
        return lambda _: True
    try:
        code = compile(expression, 'filter', 'eval')
    except SyntaxError as error:
        raise CommandError(f'Invalid filter: {error}') from error

    def holds(message: Any) -> bool:
        try:
            return bool(eval(code, {}, {'m': message}))
        except Exception as error:
            raise CommandError(f'Invalid filter: {error}') from error

    return holds
