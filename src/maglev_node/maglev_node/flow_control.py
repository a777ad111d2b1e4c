"""Lockstep waits for those who watch, for none of them long, and so loses none of their samples."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import partial
from typing import Any

from rclpy.node import Node

from maglev_node.samples import hear
from maglev_node.topics import progress_of

WINDOW = 2048
"""Samples that a watcher may be behind before it is waited for: an eighth of what is kept."""

PATIENCE = 1.0
"""So long after a watcher last told how far it is the stage goes on without it [s].

Less than the silence for which nodes take a stage for stopped: one that crawls, a sample a second,
holds the stage up and no more.
"""


class FlowControl:
    """How far the watchers of a stage are, who tell it each time they have taken measurements.

    One that has told nothing yet, as recorders of others, is not waited for; nor one that was
    stopped or killed, or is done.
    """

    def __init__(self, node: Node, names: Iterable[str]) -> None:
        self._node = node
        self._told: dict[str, tuple[int, float]] = {}  # sample, and when it was told
        self._subscriptions = [
            hear(node, progress_of(name), partial(self._on_acknowledgement, name)) for name in names
        ]

    def holds(self, sequence: int) -> bool:
        """Whether a watcher is a window behind a sample, and the next one is not to be taken."""
        now = time.monotonic()
        return any(
            sequence - taken >= WINDOW and now - when < PATIENCE
            for taken, when in self._told.values()
        )

    def destroy(self) -> None:
        """Leave the graph."""
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _on_acknowledgement(self, name: str, measurement: Any) -> None:
        self._told[name] = measurement.sequence, time.monotonic()
