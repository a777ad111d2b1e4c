"""A node that only notes what sampling asks of it, and speaks when a test does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import Any

from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rosgraph_msgs.msg import Clock

from maglev_model.contract.wire import Incoming
from maglev_msgs.msg import Measurement
from maglev_node.stage_parameters import ClockedStageParameters
from maglev_node.stamp import nanoseconds, set_stamp
from maglev_node.topics import CURRENTS, KEYS, PROGRESS, SAMPLE_TOPICS

KEYS_OF_KINDS = {kind: KEYS[topic] for topic, kind in SAMPLE_TOPICS.items()}


class Topic:
    """A publisher; messages are noted by what tells them apart."""

    def __init__(self, kind: type) -> None:
        self._kind = kind
        self._read: Any = None
        self._message = b''
        self.received: Any = None  # the newest, as nodes read it
        self.sequences: list[int] = []
        self.stamps: list[int] = []
        self.stamp_of: dict[int, int] = {}

    def publish(self, message: Any) -> None:
        if isinstance(message, Clock):
            self.stamps.append(nanoseconds(message.clock))
            return
        if self._read is None:
            self._read = Incoming(KEYS_OF_KINDS[self._kind]).read
        self._message, self.received = message, self._read(message)
        self.sequences.append(self.received.sequence)
        self.stamps.append(self.received.stamp)
        self.stamp_of[self.received.sequence] = self.stamps[-1]

    @property
    def newest(self) -> Any:
        """The newest message."""
        return deserialize_message(self._message, self._kind)


class Timer:
    """Ticks, or was cancelled."""

    def __init__(self, period: float) -> None:
        self.period, self.timer_period_ns, self.ticking = period, 0, True

    def cancel(self) -> None:
        self.ticking = False

    def reset(self) -> None:
        self.ticking = True


class Inbox:
    """The queue of currents in real time."""

    def __init__(self, stamped: Callable[[Any], Any]) -> None:
        self.messages: list[Any] = []
        self._stamped = stamped

    topic = '/stage/currents'

    def take(self, _at_most: int) -> Iterator[tuple[bytes, int]]:
        waiting, self.messages = self.messages, []
        return ((serialize_message(self._stamped(message)), 0) for message in waiting)


class MadeUpNode:
    """What sampling asks of a node."""

    steady_clock = None

    def __init__(self, **parameters: Any) -> None:
        self.parameters = ClockedStageParameters(**parameters)
        self.topics: dict[type, Topic] = {}
        self.depths: set[int] = set()  # of the publishers of each sample
        self.progress: dict[str, Topic] = {}
        self.errors: list[str] = []
        self.failed: list[str] = []
        self.timers: list[Any] = []
        self.fail = self.failed.append
        self.inbox = Inbox(self.stamped)
        self.subscribers: dict[str, list[str]] = {}
        self.hears: dict[str, Callable[[Any], None]] = {}  # all but the currents, by topic
        self.controllers = 0  # that publish currents

    def get_namespace(self) -> str:
        return '/'

    def resolve_topic_name(self, topic: str) -> str:
        return f'/{topic}'

    def get_subscriptions_info_by_topic(self, topic: str) -> list[Any]:
        names = self.subscribers.get(topic, [])
        return [SimpleNamespace(node_name=name, node_namespace='/') for name in names]

    def create_publisher(self, message_type: type, topic: str, qos: QoSProfile) -> Topic:
        if topic in PROGRESS:
            return self.progress.setdefault(topic, Topic(message_type))
        self.depths.add(qos.depth)
        return self.topics.setdefault(message_type, Topic(message_type))

    def create_subscription(
        self, _type: type, topic: str, callback: Any, _qos: Any, *, raw: bool
    ) -> Any:
        assert raw
        if topic != CURRENTS:
            self.hears[topic] = lambda message: callback(serialize_message(message))
            return SimpleNamespace()
        self.answer = lambda message: callback(serialize_message(self.stamped(message)))
        return SimpleNamespace(
            topic_name='/stage/currents', get_publisher_count=lambda: self.controllers
        )

    def poll(self, _topic: str, _type: type, _qos: Any, *, raw: bool) -> Inbox:
        assert raw
        return self.inbox

    def create_timer(self, period: float, action: Any, clock: Any) -> Any:
        self.tick = action
        timer = Timer(period)
        self.timers.append(timer)
        return timer

    def destroy_timer(self, timer: Any) -> None:
        self.timers.remove(timer)

    def get_logger(self) -> Any:
        return SimpleNamespace(error=self.errors.append)

    def stamped(self, message: Any) -> Any:
        """A message with the stamp of its measurement, unless it has one already."""
        if Measurement in self.topics and not nanoseconds(message.header.stamp):
            stamps = self.topics[Measurement].stamp_of
            set_stamp(message.header.stamp, stamps.get(message.sequence, 0))
        return message

    @property
    def measured(self) -> list[int]:
        return self.topics[Measurement].sequences
