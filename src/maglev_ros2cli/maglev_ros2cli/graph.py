"""A node on the graph for as long as a command takes, and what it sees there."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

from maglev_node.dds import prepare_middleware
from maglev_node.polling import PollingNode
from maglev_ros2cli.errors import CommandError
from maglev_ros2cli.parser import Parser, complete

LEAST_WAIT, QUIET, MOST_WAIT = 0.6, 0.3, 3.0
"""Discovery: its shortest time, how long nothing new must come, its longest time [s]."""

SERVICE_PATIENCE = 5.0
"""How long a service that should be there is waited for [s]."""

_TICK = 0.01


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
        type=float,
        metavar='SECONDS',
        help='Time to wait for discovery (default: until nothing new comes)',
    )
    parser.add_argument('--no-daemon', action='store_true', help='As ever: this ros2 has no daemon')


@contextlib.contextmanager
def node(name: str | None = None) -> Iterator[PollingNode]:
    """A node that nothing was discovered by yet."""
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
        own.destroy_node()
        rclpy.try_shutdown()


@contextlib.contextmanager
def graph(arguments: Any, name: str | None = None) -> Iterator[PollingNode]:
    """A node that has discovered what there is."""
    with node(name) as own:
        discover(own, getattr(arguments, 'spin_time', None))
        yield own


def discover(own: PollingNode, spin_time: float | None = None) -> None:
    """Wait for ``spin_time`` [s], by default until the graph is quiet."""
    start = changed = time.monotonic()
    seen: object = None
    while True:
        now = time.monotonic()
        if spin_time is not None:
            if now - start >= spin_time:
                return
        else:
            state = _state(own)
            if state != seen:
                seen, changed = state, now
            if (now - start >= LEAST_WAIT and now - changed >= QUIET) or now - start >= MOST_WAIT:
                return
        time.sleep(_TICK)


def _state(own: PollingNode) -> object:
    return (
        own.get_node_names_and_namespaces(),
        own.get_topic_names_and_types(),
        own.get_service_names_and_types(),
    )


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


def find_node(own: PollingNode, name: str, *, hidden: bool = False) -> NodeName:
    """The node of a name. Raises :class:`CommandError` where there is none."""
    full = absolute(name)
    for each in nodes(own, hidden=hidden):
        if each.full == full:
            return each
    raise CommandError('Node not found')


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


def absolute(name: str) -> str:
    """The full name of what a command line may name without the leading slash."""
    return name if name.startswith('/') else f'/{name}'


def call(
    own: PollingNode, kind: type, service: str, request: Any, timeout: float | None = None
) -> Any:
    """The response of a service.

    Raises :class:`CommandError` where there is no such service, or no answer within ``timeout``
    [s], which is by default waited for for ever.
    """
    client = own.create_client(kind, service)
    if not wait_until(client.service_is_ready, SERVICE_PATIENCE):
        raise CommandError(f"Wait for service timed out: '{service}'")
    return answer(own, client, request, timeout)


def answer(own: PollingNode, client: Any, request: Any, timeout: float | None = None) -> Any:
    """The response of a service that is ready, as :func:`call`."""
    future = client.call_async(request)
    end = None if timeout is None else time.monotonic() + timeout
    while not future.done():
        rclpy.spin_until_future_complete(own, future, timeout_sec=0.1)
        if end is not None and time.monotonic() >= end and not future.done():
            raise CommandError(f"no answer of service '{client.srv_name}' within {timeout:g} s")
    return future.result()


# -- completion ------------------------------------------------------------------------------------


def add_node_name(parser: Parser, **options: Any) -> None:
    """The argument ``node_name``, completed from the graph."""
    argument = parser.add_argument('node_name', help='Name of the ROS node', **options)
    complete(argument, lambda given: _seen(given, lambda own: [each.full for each in nodes(own)]))


def add_topic_name(parser: Parser, text: str) -> None:
    """The argument ``topic_name``, completed from the graph."""
    argument = parser.add_argument('topic_name', help=text)
    complete(argument, lambda given: _seen(given, lambda own: list(topics(own, hidden=False))))


def add_service_name(parser: Parser, text: str) -> None:
    """The argument ``service_name``, completed from the graph."""
    argument = parser.add_argument('service_name', help=text)
    complete(argument, lambda given: _seen(given, lambda own: list(services(own, hidden=False))))


def _seen(given: Any, look: Callable[[PollingNode], list[str]]) -> list[str]:
    with graph(given) as own:
        return look(own)
