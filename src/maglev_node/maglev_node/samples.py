"""The sample topics on the graph: read and written in place, without building message objects."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from maglev_model.contract.wire import DecodeError, Incoming, Outgoing
from maglev_node.polling import PollingNode
from maglev_node.topics import KEYS, PROGRESS_PERIOD, SAMPLE_TOPICS, sample_qos, sampled

_FRAME = 'stage'


class SampleWriter(Outgoing):
    """Publishes a sample topic; what is not written before is as in the message before."""

    def __init__(self, node: Node, topic: str, qos: QoSProfile) -> None:
        super().__init__(KEYS[topic], _FRAME)
        self.publisher = node.create_publisher(SAMPLE_TOPICS[topic], topic, qos)

    def publish(self) -> None:
        """Publish the message as it is now."""
        self.publisher.publish(self.serialized())


class ProgressWriter:
    """Passes the messages of a sample topic on, to whoever need not be woken for each of them.

    In flight each reader of each sample takes its time of the loop's.
    """

    def __init__(self, node: Node, topic: str, samples: SampleWriter) -> None:
        self.publisher = node.create_publisher(SAMPLE_TOPICS[sampled(topic)], topic, sample_qos(1))
        self._samples = samples
        self._steady = False

    def publish(self, sequence: int, *, steady: bool) -> None:
        """Publish each sample until what it tells is steady, then every sixteenth."""
        if not (steady and self._steady) or sequence % PROGRESS_PERIOD == 0:
            self.publisher.publish(self._samples.serialized())
        self._steady = steady


class SampleReader:
    """Reads what comes on a sample topic; what cannot be read is left out, and said once."""

    def __init__(self, node: Node, topic: str) -> None:
        self._node, self._topic = node, topic
        self._incoming = Incoming(KEYS[sampled(topic)])

    def read(self, message: bytes) -> Any:
        """A named tuple of the header's ``stamp`` [ns] and the message's fields, or None."""
        try:
            return self._incoming.read(message)
        except DecodeError as error:
            topic = self._node.resolve_topic_name(self._topic)
            self._node.get_logger().error(f'{topic}: {error}', once=True)
            return None


def hear(node: Node, topic: str, callback: Callable[[Any], None]) -> Subscription[Any]:
    """Subscribe to a sample topic: ``callback`` is called with what :class:`SampleReader` reads.

    The subscription is of serialized messages, and so is its own callback.
    """
    reader = SampleReader(node, topic)

    def take(message: bytes) -> None:
        sample = reader.read(message)
        if sample is not None:
            callback(sample)

    message_type = SAMPLE_TOPICS[sampled(topic)]
    return node.create_subscription(message_type, topic, take, sample_qos(), raw=True)


class SampleQueue:
    """A topic of samples, or of their progress, whose messages wait until they are taken.

    ``raw`` is the queue of the serialized messages.
    """

    def __init__(self, node: PollingNode, topic: str, qos: QoSProfile | None = None) -> None:
        self.raw = node.poll(topic, SAMPLE_TOPICS[sampled(topic)], qos, raw=True)
        self._reader = SampleReader(node, topic)

    def take(self, at_most: int = 100_000) -> Iterator[Any]:
        """What waits, oldest first, as :class:`SampleReader` reads it."""
        for message, _ in self.raw.take(at_most):
            sample = self._reader.read(message)
            if sample is not None:
                yield sample
