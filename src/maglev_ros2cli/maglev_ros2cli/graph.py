"""A node on the graph for as long as a command takes, and what it sees there."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, NamedTuple

import rclpy
from rclpy.exceptions import InvalidTopicNameException
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden
from rclpy.validate_full_topic_name import validate_full_topic_name

from maglev_model.programs.arguments import not_negative
from maglev_node.dds import local_participants, only_here, prepare_middleware
from maglev_node.leaving import stop_receiving
from maglev_node.polling import PollingNode
from maglev_ros2cli.parser import CommandError, Parser, Verbs, complete

QUIET = 0.15
"""Discovery ends when every participant of this machine is seen and nothing new comes so long [s].
"""

NEEDED_QUIET = 2.0
"""The same where something is asked for by its name and is not there yet [s]."""

ABROAD_WAIT, MOST_WAIT = 1.0, 5.0
"""It takes at least so long where other machines may take part, and at most so long [s]."""

SERVICE_PATIENCE = 10.0
"""How long a service that should be there is waited for [s]."""

RESEND = 2.0
"""After how long a question is put again: an answer may be lost that comes too early [s]."""

_EVERYWHERE = ('/parameter_events', '/rosout')
"""Topics to which every node publishes."""
_UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""What rmw calls the node of an endpoint until its participant has told its nodes."""

_TICK = 0.01
_PREFIX = 12  # bytes of a GUID that are its participant's (DDSI-RTPS 8.2.4.1)


class NodeName(NamedTuple):
    """A node: its name and namespace."""

    name: str
    namespace: str

    @property
    def full(self) -> str:
        """The name with the namespace."""
        return f'{self.namespace.rstrip("/")}/{self.name}'

    @property
    def hidden(self) -> bool:
        """Whether it is none that a user has started."""
        return self.name.startswith('_')


def add_arguments(parser: Parser) -> None:
    """The options of every command that looks at the graph."""
    parser.add_argument(
        '--spin-time',
        type=not_negative,
        metavar='SECONDS',
        help='Time to wait for discovery (default: until nothing new comes)',
    )
    parser.flag('--no-daemon', help='As ever: this ros2 has no daemon')


@contextlib.contextmanager
def node(name: str | None = None) -> Iterator[PollingNode]:
    """A node that has discovered nothing yet."""
    prepare_middleware()
    try:
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        own = PollingNode(
            name or f'_ros2cli_{os.getpid()}',
            use_global_arguments=False,
            start_parameter_services=False,
        )
    except Exception as error:
        if not type(error).__module__.startswith(('rclpy', '_rclpy')):
            raise
        raise CommandError(str(error).split(', at /')[0]) from error
    try:
        yield own
    finally:
        stop_receiving()
        own.destroy_node()
        rclpy.try_shutdown()


@contextlib.contextmanager
def graph(
    arguments: Any, needed: Callable[[PollingNode], object] | None = None
) -> Iterator[PollingNode]:
    """A node that has discovered what there is, or at least what is ``needed`` of it."""
    with node() as own:
        spin_time = getattr(arguments, 'spin_time', None)
        discover(own, spin_time, None if needed is None else lambda: bool(needed(own)))
        yield own


@contextlib.contextmanager
def graph_with(arguments: Any) -> Iterator[tuple[PollingNode, str]]:
    """A node that has discovered the one that is named, and the full name of that.

    Raises :class:`CommandError` where there is none.
    """
    full = absolute(arguments.node_name)
    hidden = getattr(arguments, 'include_hidden_nodes', False)

    def there() -> bool:
        return full in {each.full for each in nodes(own, hidden=hidden)}

    with node() as own:
        if not discover(own, arguments.spin_time, there):
            raise CommandError('Node not found')
        yield own, full


def discover(
    own: PollingNode, spin_time: float | None = None, needed: Callable[[], bool] | None = None
) -> bool:
    """Wait for ``spin_time`` [s], by default until the graph is known.

    The wait ends as soon as what is ``needed`` is there. Returns whether it is.
    """
    start = changed = time.monotonic()
    quiet = QUIET if needed is None else NEEDED_QUIET
    seen: object = None
    while True:
        now = time.monotonic()
        if needed is not None and needed():
            return True
        state = (
            own.get_node_names_and_namespaces(),
            own.get_topic_names_and_types(),
            own.get_service_names_and_types(),
        )
        if state != seen:
            seen, changed = state, now
        if spin_time is not None:
            over = now - start >= spin_time
        else:
            known = now - changed >= quiet and _complete(own, now - start)
            over = known or now - start >= MOST_WAIT
        if over:
            return needed is None
        time.sleep(_TICK)


def _complete(own: PollingNode, waited: float) -> bool:
    """Whether every participant of this machine is seen, and those of others have had the time."""
    try:
        there = local_participants(own.context.get_domain_id())
    except OSError:
        return waited >= ABROAD_WAIT
    infos = [info for topic in _EVERYWHERE for info in own.get_publishers_info_by_topic(topic)]
    participants = {
        bytes(info.endpoint_gid[:_PREFIX]) for info in infos if info.node_name != _UNKNOWN
    }
    return len(participants) >= there and (only_here() or waited >= ABROAD_WAIT)


def wait_until(condition: Callable[[], bool], timeout: float | None = None) -> bool:
    """Whether something came to hold within a time [s]; by default that is waited for for ever."""
    end = None if timeout is None else time.monotonic() + timeout
    while not condition():
        if end is not None and time.monotonic() >= end:
            return False
        time.sleep(_TICK)
    return True


def nodes(own: PollingNode, *, hidden: bool = False) -> list[NodeName]:
    """The nodes on the graph, sorted, those of the same name as often as they are there."""
    found = (NodeName(*pair) for pair in own.get_node_names_and_namespaces())
    return sorted((each for each in found if hidden or not each.hidden), key=lambda each: each.full)


def topics(own: PollingNode, *, hidden: bool = True) -> dict[str, list[str]]:
    """The topics on the graph with their types, sorted."""
    return _shown(own.get_topic_names_and_types(), hidden)


def services(own: PollingNode, *, hidden: bool = True) -> dict[str, list[str]]:
    """The services on the graph with their types, sorted."""
    return _shown(own.get_service_names_and_types(), hidden)


def _shown(found: list[tuple[str, list[str]]], hidden: bool) -> dict[str, list[str]]:
    return {
        name: types
        for name, types in sorted(found)
        if hidden or not topic_or_service_is_hidden(name)
    }


def print_all(lines: Collection[str], *, count: bool) -> None:
    """Each in a line, or only how many there are."""
    for line in [len(lines)] if count else lines:
        print(line)


def print_type(
    arguments: Any, name: str, look: Callable[[PollingNode], dict[str, list[str]]]
) -> int:
    """The type of a topic or service; of an unknown one exit code 1 and no word, as in ros2cli."""
    full = absolute(name)
    with graph(arguments, lambda own: full in look(own)) as own:
        types = look(own).get(full, [])
    for each in types:
        print(each)
    return 0 if types else 1


def absolute(name: str) -> str:
    """The full name of what a command line may name without the leading slash.

    Raises :class:`CommandError` for what is no name.
    """
    full = name if name.startswith('/') else f'/{name}'
    try:
        validate_full_topic_name(full)
    except InvalidTopicNameException as error:
        reason = str(error).splitlines()[0].partition(': ')[2]
        raise CommandError(f"'{name}' is no name: {reason.rstrip(':')}") from error
    return full


def ask(own: PollingNode, kind: type, service: str, request: Any) -> Any:
    """The response of a service that may be asked twice.

    Raises :class:`CommandError` where there is no such service.
    """
    return answer(own, client(own, kind, service), request, resend=RESEND)


def client(own: PollingNode, kind: type, service: str) -> Any:
    """A client of a service that is ready. Raises :class:`CommandError` where there is none."""
    made = own.create_client(kind, service)
    if not wait_until(made.service_is_ready, SERVICE_PATIENCE):
        raise CommandError(f"Wait for service timed out: '{service}'")
    return made


def answer(own: PollingNode, client: Any, request: Any, *, resend: float = math.inf) -> Any:
    """The response of a service that is ready, waited for until it comes.

    It may be lost when the service has not seen who asks yet: ``resend`` [s] asks again.
    """
    futures: list[Any] = []
    asked = -math.inf
    while not any(future.done() for future in futures):
        if time.monotonic() - asked >= resend or not futures:
            asked = time.monotonic()
            futures.append(client.call_async(request))
        rclpy.spin_until_future_complete(own, futures[-1], timeout_sec=0.1)
    return next(future.result() for future in futures if future.done())


# -- arguments -------------------------------------------------------------------------------------


def add_node_verb(verbs: Verbs, name: str, run: Any, text: str, **node: Any) -> Parser:
    """A verb about a node that is named, with the options of such."""
    verb = verbs.add(name, run, text)
    add_arguments(verb)
    add_node_name(verb, **node)
    verb.flag('--include-hidden-nodes', help='Consider hidden nodes as well')
    return verb


def add_node_name(parser: Parser, **options: Any) -> None:
    """The argument ``node_name``, completed from the graph."""
    argument = parser.add_argument('node_name', help='Name of the ROS node', **options)
    complete(argument, lambda given: _seen(given, lambda own: (one.full for one in nodes(own))))


def add_topic_name(parser: Parser, text: str) -> None:
    """The argument ``topic_name``, completed from the graph."""
    complete(parser.add_argument('topic_name', help=text), seen_topics)


def add_service_name(parser: Parser, text: str) -> None:
    """The argument ``service_name``, completed from the graph."""
    argument = parser.add_argument('service_name', help=text)
    complete(argument, lambda given: _seen(given, lambda own: services(own, hidden=False)))


def seen_topics(given: Any) -> list[str]:
    """The topics that a shell offers."""
    return _seen(given, lambda own: topics(own, hidden=False))


def _seen(given: Any, look: Callable[[PollingNode], Iterable[str]]) -> list[str]:
    with graph(given) as own:
        return list(look(own))
