"""Subscriptions that are drained in bursts instead of waking their node for every message."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from maglev_node.topics import sample_qos


class PollingNode(Node):
    """A node with queues that the middleware fills and the node empties when it likes.

    Waking a Python process for each of several thousand messages a second would cost the two cores
    more than the control loop does; taking them in bursts costs a fraction.
    """

    @property
    def subscriptions(self) -> Iterator[Any]:
        """Those that an executor dispatches: all but the polled ones."""
        return (each for each in super().subscriptions if each.callback is not _never_called)

    def poll(
        self, topic: str, message_type: type, qos: QoSProfile | None = None, *, raw: bool = False
    ) -> PolledSubscription:
        """A queue of messages, by default for samples; ``raw`` gives them serialised, as bytes.

        The depth of ``qos`` must cover what arrives between two polls; with depth 1 the queue
        holds the newest.
        """
        return PolledSubscription(
            self,
            self.create_subscription(
                message_type, topic, _never_called, qos or sample_qos(), raw=raw
            ),
        )


class PolledSubscription:
    """One topic whose messages wait until they are taken."""

    def __init__(self, node: Node, subscription: Any) -> None:
        self._node = node
        self._subscription = subscription
        self.topic: str = subscription.topic_name

    def take(self, at_most: int = 100_000) -> Iterator[tuple[Any, int]]:
        """Messages waiting, oldest first, each with its time of reception [ns since the epoch]."""
        subscription = self._subscription
        with subscription.handle:
            for _ in range(at_most):
                taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
                if taken is None:
                    return
                yield taken[0], taken[1]['received_timestamp']

    def publisher_count(self) -> int:
        """How many publishers the topic has."""
        return int(self._subscription.get_publisher_count())

    def destroy(self) -> None:
        """Give the queue up."""
        self._node.destroy_subscription(self._subscription)


def _never_called(_message: Any) -> None:
    """What rclpy wants as a callback; nothing ever dispatches a polled subscription."""
