"""One node of a kind on the graph, judged by what a made-up graph shows."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest

from maglev_node import graph_guard
from maglev_node.graph_guard import GraphGuard
from maglev_node.node import NodeError

OTHER = SimpleNamespace(node_namespace='/', node_name='other')


class Node:
    """Discovers others since long ago, and publishes what it claims."""

    steady_clock = None

    def __init__(self) -> None:
        self.discovering_since = time.monotonic() - 60.0  # it took that long to load
        self.publishers: list[Any] = []
        self.failed: list[str] = []
        self.looks: list[str] = []

    def get_publishers_info_by_topic(self, _topic: str) -> list[Any]:
        return self.publishers

    def resolve_topic_name(self, topic: str) -> str:
        return f'/{topic}'

    def fail(self, message: str) -> None:
        self.failed.append(message)

    def create_timer(self, _period: float, look: Any, clock: Any) -> Any:
        self.look = look
        return SimpleNamespace(
            reset=lambda: self.looks.append('on'), cancel=lambda: self.looks.append('off')
        )


def test_what_another_publishes_is_not_claimed() -> None:
    node: Any = Node()
    node.publishers = [OTHER]
    with pytest.raises(NodeError, match="/stage/currents is already published by '/other'"):
        GraphGuard(node).claim('stage/currents', 'controller')


def test_two_that_claim_at_once_after_a_long_start_still_find_each_other() -> None:
    node: Any = Node()
    guard = GraphGuard(node)
    assert not guard.on_probation()
    guard.claim('stage/currents', 'controller')
    assert guard.on_probation()
    node.publishers = [OTHER, OTHER]
    node.look()
    assert 'another controller' in node.failed[0]


def test_each_claim_has_a_probation_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a stage that is configured anew."""
    node: Any = Node()
    guard = GraphGuard(node)
    guard.claim('stage/currents', 'controller')
    with monkeypatch.context() as patch:
        patch.setattr(graph_guard, '_PROBATION', 0.0)
        node.look()
    assert node.looks == ['off']
    guard.claim('stage/currents', 'controller')
    assert guard.on_probation()
    node.look()
    assert node.looks == ['off', 'on']


def test_what_flies_stays_and_the_newcomer_leaves() -> None:
    """A newcomer that was discovered while the first was still on probation."""
    flies = True
    first: Any = Node()
    newcomer: Any = Node()
    GraphGuard(first, lambda: flies).claim('stage/measurement', 'stage')
    GraphGuard(newcomer, lambda: False).claim('stage/measurement', 'stage')
    for node in (first, newcomer):
        node.publishers = [OTHER, OTHER]
        node.look()
    assert first.failed == []
    assert 'another stage' in newcomer.failed[0]
    flies = False
    first.look()
    assert 'another stage' in first.failed[0]
