"""Subscriptions that are drained in bursts instead of waking their node for every message."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from maglev_node.topics import sample_qos

POLL_PERIOD = 0.02
"""How often those who only watch look at their queues [s]."""


class Queues:
    """Queues of a node's topics, filled by the middleware and emptied when the node likes.

    Waking a Python process for each of several thousand messages a second would cost the two cores
    more than the control loop does; taking them in bursts costs a fraction. The subscriptions sit
    on a hidden companion node that no executor serves.
    """

    def __init__(self, node: Node) -> None:
        self._companion = Node(
            f'_{node.get_name()}_queues',
            context=node.context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )

    def subscribe(
        self, topic: str, message_type: type, qos: QoSProfile | None = None, *, raw: bool = False
    ) -> PolledSubscription:
        """A queue of messages, by default for samples; ``raw`` gives them serialised, as bytes.

        The depth of ``qos`` must cover what arrives between two polls; with depth 1 the queue holds
        the newest.
        """
        subscription = self._companion.create_subscription(
            message_type, topic, _never_called, qos or sample_qos(), raw=raw
        )
        return PolledSubscription(subscription)

    def destroy(self) -> None:
        """Give the queues up."""
        self._companion.destroy_node()


class PolledSubscription:
    """One topic whose messages wait until they are taken."""

    def __init__(self, subscription: Any) -> None:
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


def _never_called(_message: Any) -> None:
    """What rclpy wants as a callback; nothing ever dispatches a polled subscription."""
