"""Who is on the graph: one node of a kind, of which the later leaves; and who shall watch."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.exceptions import InvalidNodeNameException
from rclpy.node import Node
from rclpy.timer import Timer
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rclpy.validate_node_name import validate_node_name

from maglev_node import dds
from maglev_node.node import MaglevNode, NodeError
from maglev_node.place import Place

DISCOVERY_TIME = 1.0
"""How long a node looks for others of its kind on other machines before it takes its place [s]."""

_PROBATION = 5.0
"""How long it goes on looking from when it has, and is the one to leave [s]."""

_LOOK_PERIOD = 0.25  # [s]
_PAUSE = 0.02  # between two looks of who waits [s]
_MATCHING = 0.1  # at most, from when the graph shows a subscription to when it gets messages [s]
_REMINDER = 5.0  # between two lines about who is waited for [s]
_NAMELESS = '_NODE_NAME_UNKNOWN_'  # to the middleware, whose publishers are discovered before names


def node_of(endpoint: TopicEndpointInfo) -> str:
    """The full name of the node that a publisher or subscription is of; '' until discovered."""
    if endpoint.node_name == _NAMELESS:
        return ''
    return f'{endpoint.node_namespace.rstrip("/")}/{endpoint.node_name}'


class GraphGuard:
    """Keeps a node the only publisher of the topic it claims.

    On this machine by a :class:`~maglev_node.place.Place`, at once. Of other machines, and of
    strangers, discovery tells. It can take longer than :data:`DISCOVERY_TIME`, and two may claim it
    at once, so the node goes on looking for some seconds, and leaves when it finds another then;
    but not while it flies the platen, for the other one, which does not, finds it as well.

    :param flying: whether it does.
    """

    def __init__(self, node: MaglevNode[Any], flying: Callable[[], bool] = lambda: False) -> None:
        self._node, self._flying = node, flying
        self._topic = self._kind = ''
        self._claimed = -math.inf  # when [s, monotonic]
        self._timer: Timer | None = None
        self._place = Place()
        node.at_end.callback(self.release)

    def claim(self, topic: str, kind: str) -> None:
        """Be the only publisher of a topic: raise NodeError when another node publishes it.

        Called before the publisher is made. Where other machines may be on the graph, waits until
        discovery has had :data:`DISCOVERY_TIME` since it began. ``kind`` names the node in
        messages.
        """
        known = self._node.discovering_since + (0.0 if dds.only_here() else DISCOVERY_TIME)
        while time.monotonic() < known:
            time.sleep(_PAUSE)
        self._topic, self._kind = topic, kind
        self._take_place()
        self._claimed = time.monotonic()
        if self._timer is not None:
            self._timer.reset()
        else:
            self._timer = self._node.create_timer(
                _LOOK_PERIOD, self._look_again, clock=self._node.steady_clock
            )

    def _take_place(self) -> None:
        """Where it is taken, wait for discovery to tell by whom, or for that one to end."""
        name = f'{self._node.context.get_domain_id()} {self._node.resolve_topic_name(self._topic)}'
        until = time.monotonic() + _PROBATION
        while True:
            over = time.monotonic() > until
            publishers = self._node.get_publishers_info_by_topic(self._topic)
            if publishers and (over or publishers[0].node_name != _NAMELESS):
                raise NodeError(self._taken(publishers[0]))
            if not publishers and self._place.take(name):
                return
            if over:
                raise NodeError(self._taken())
            time.sleep(_PAUSE)

    def release(self) -> None:
        """Let another process on this machine claim it."""
        self._place.leave()

    def alone(self) -> bool:
        """Whether what was claimed still has one publisher; otherwise the node ends."""
        publishers = self._node.get_publishers_info_by_topic(self._topic)
        if len(publishers) > 1:
            own = self._node.get_name(), self._node.get_namespace()
            others = (p for p in publishers if (p.node_name, p.node_namespace) != own)
            another = next(others, publishers[0])  # of the same name
            self._node.fail(self._taken(another))
        return len(publishers) <= 1

    def on_probation(self) -> bool:
        """Whether the claim is so young that another of its kind may yet be discovered."""
        return time.monotonic() - self._claimed < _PROBATION

    def _look_again(self) -> None:
        if not self._flying():
            self.alone()
        if self._timer is not None and not self.on_probation():
            self._timer.cancel()

    def _taken(self, who: TopicEndpointInfo | None = None) -> str:
        whom = 'a process on this machine'
        if who is not None:
            name = node_of(who)
            whom = f"'{name}'" if name else 'a node whose name is not discovered yet'
        return (
            f'{self._node.resolve_topic_name(self._topic)} is already published by {whom}: there is'
            f' another {self._kind} on this graph; stop it, or use another namespace or'
            ' ROS_DOMAIN_ID'
        )


class Watchers:
    """Nodes, by name and in the namespace of ``node``, that shall see all it publishes on topics.

    Whoever else subscribes counts for nothing.
    """

    def __init__(self, node: Node, names: Iterable[str], *topics: str) -> None:
        """Raises NodeError for what cannot be the name of a node."""
        names = tuple(names)
        for name in names:
            try:
                validate_node_name(name)
            except InvalidNodeNameException as error:
                raise NodeError(
                    f"parameter 'watchers' is {list(names)}, and {name!r} is no name of a node:"
                    ' letters, digits and underscores, without its namespace'
                ) from error
        self._node, self._names, self._topics = node, names, topics
        self._since: dict[tuple[str, str], float] = {}  # that a name subscribes to a topic [s]
        self._reminded = time.monotonic()

    def missing(self) -> list[str]:
        """Those that do not yet get what is published on all of these topics."""
        ready = set(self._names)
        if self._names:
            for topic in self._topics:
                ready &= self._ready(topic)
        return [name for name in self._names if name not in ready]

    def awaited(self) -> str:
        """Who is waited for, in a line, or ''."""
        if not (missing := self.missing()):
            return ''
        where = ' and '.join(map(self._node.resolve_topic_name, self._topics))
        return f'waiting for {", ".join(missing)} to subscribe to {where}'

    def there(self) -> bool:
        """Whether none is missing; now and then says who is."""
        awaited = self.awaited()
        if awaited:
            self.remind(awaited)
        return not awaited

    def remind(self, awaited: str) -> None:
        """Say now and then who is waited for."""
        if time.monotonic() - self._reminded > _REMINDER:
            self._reminded = time.monotonic()
            self._node.get_logger().info(awaited)

    def _ready(self, topic: str) -> set[str]:
        here, now = self._node.get_namespace(), time.monotonic()
        subscribed = {
            reader.node_name
            for reader in self._node.get_subscriptions_info_by_topic(topic)
            if reader.node_namespace == here
        }
        for name in self._names:
            if name in subscribed:
                self._since.setdefault((name, topic), now)
            else:
                self._since.pop((name, topic), None)
        since = self._since
        return {name for name in subscribed if now - since.get((name, topic), now) > _MATCHING}
