"""One node of a kind on the graph, judged by what a made-up graph shows."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import count
from types import SimpleNamespace
from typing import Any

import pytest

from maglev_node import graph_guard
from maglev_node.graph_guard import GraphGuard, Watchers, node_of
from maglev_node.node import NodeError
from maglev_node.place import Place

machines, at_end = count(1000), ExitStack()
OTHER = SimpleNamespace(node_namespace='/', node_name='other')
OWN = SimpleNamespace(node_namespace='/', node_name='own')
NAMELESS = SimpleNamespace(
    node_namespace='_NODE_NAMESPACE_UNKNOWN_', node_name='_NODE_NAME_UNKNOWN_'
)
HOLDING = """
from maglev_node.place import Place
place = Place()
print(place.take('here'), flush=True)
input()
"""


@pytest.fixture(autouse=True)
def _all_end() -> Iterator[None]:
    yield
    at_end.close()


class Node:
    """Discovers others since long ago, and publishes what it claims; alone on its machine."""

    steady_clock = None

    def __init__(self, machine: int | None = None) -> None:
        domain = next(machines) if machine is None else machine
        self.context = SimpleNamespace(get_domain_id=lambda: domain)
        self.at_end = at_end.enter_context(ExitStack())
        self.discovering_since = time.monotonic() - 60.0  # it took that long to load
        self.publishers: list[Any] = []
        self.failed: list[str] = []
        self.looks: list[str] = []

    def get_name(self) -> str:
        return OWN.node_name

    def get_namespace(self) -> str:
        return OWN.node_namespace

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


def test_a_node_is_named_in_full_once_its_name_is_discovered() -> None:
    nested = SimpleNamespace(node_namespace='/left', node_name='other')
    named = [node_of(each) for each in (OTHER, nested, NAMELESS)]  # type: ignore[arg-type]
    assert named == ['/other', '/left/other', '']


def test_what_a_nameless_one_publishes_is_not_claimed_and_its_name_is_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    node: Any = Node()
    seen = iter([[NAMELESS], [NAMELESS], [OTHER]])
    monkeypatch.setattr(node, 'get_publishers_info_by_topic', lambda _topic: next(seen))
    with pytest.raises(NodeError, match="is already published by '/other'"):
        GraphGuard(node).claim('stage/currents', 'controller')
    assert not list(seen)
    monkeypatch.setattr(graph_guard, '_PROBATION', 0.1)
    node = Node()
    node.publishers = [NAMELESS]
    with pytest.raises(NodeError, match='by a node whose name is not discovered yet: there is'):
        GraphGuard(node).claim('stage/currents', 'controller')


def test_two_that_claim_at_once_after_a_long_start_still_find_each_other() -> None:
    node: Any = Node()
    guard = GraphGuard(node)
    assert not guard.on_probation()
    guard.claim('stage/currents', 'controller')
    assert guard.on_probation()
    for publishers in ([OWN, OTHER], [OTHER, OWN]):
        node.publishers = publishers
        node.look()
        assert "is already published by '/other': there is another controller" in node.failed.pop()


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
        node.publishers = [OWN, OTHER]
        node.look()
    assert first.failed == []
    assert 'another stage' in newcomer.failed[0]
    flies = False
    first.look()
    assert 'another stage' in first.failed[0]


def test_on_one_machine_the_second_is_refused_though_nothing_is_discovered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(graph_guard, '_PROBATION', 0.1)
    first: Any = Node(7)
    GraphGuard(first).claim('stage/measurement', 'stage')
    with pytest.raises(NodeError, match='by a process on this machine: there is another stage'):
        GraphGuard(Node(7)).claim('stage/measurement', 'stage')  # type: ignore[arg-type]
    GraphGuard(Node(8)).claim('stage/measurement', 'stage')  # type: ignore[arg-type]
    GraphGuard(Node(7)).claim('other/measurement', 'stage')  # type: ignore[arg-type]
    first.at_end.close()
    GraphGuard(Node(7)).claim('stage/measurement', 'stage')  # type: ignore[arg-type]


@pytest.mark.parametrize(('here', 'waited'), [(True, False), (False, True)])
def test_discovery_is_waited_for_where_there_may_be_other_machines(
    monkeypatch: pytest.MonkeyPatch, *, here: bool, waited: bool
) -> None:
    monkeypatch.setattr(graph_guard, 'DISCOVERY_TIME', 0.5)
    monkeypatch.setattr(graph_guard.dds, 'only_here', lambda: here)
    node: Any = Node()
    node.discovering_since = time.monotonic()
    GraphGuard(node).claim('stage/measurement', 'stage')
    assert (time.monotonic() - node.discovering_since >= 0.5) == waited


def test_a_released_claim_is_anothers_to_make(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a stage that is cleaned up."""
    monkeypatch.setattr(graph_guard, '_PROBATION', 0.1)
    guard, other = GraphGuard(Node(9)), GraphGuard(Node(9))  # type: ignore[arg-type]
    guard.claim('stage/measurement', 'stage')
    guard.claim('stage/measurement', 'stage')
    guard.release()
    other.claim('stage/measurement', 'stage')
    with pytest.raises(NodeError):
        guard.claim('stage/measurement', 'stage')


def test_who_takes_a_place_is_waited_for_and_named(monkeypatch: pytest.MonkeyPatch) -> None:
    guard, late = GraphGuard(Node(10)), Node(10)  # type: ignore[arg-type]
    guard.claim('stage/currents', 'controller')
    looks = iter([[], [], [OTHER]])
    monkeypatch.setattr(late, 'get_publishers_info_by_topic', lambda _topic: next(looks))
    with pytest.raises(NodeError, match="is already published by '/other'"):
        GraphGuard(late).claim('stage/currents', 'controller')  # type: ignore[arg-type]


def test_a_place_is_free_when_its_process_is_killed() -> None:
    command = [sys.executable, '-c', HOLDING]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == 'True\n'
        place = Place()
        assert not place.take('here')
        other.kill()
    assert place.take('here')
    place.leave()


@pytest.mark.parametrize('name', ['my-node', '/recorder', '2nd', ''])
def test_a_name_that_no_node_can_have_is_not_waited_for(name: str) -> None:
    made_up: Any = Node()
    with pytest.raises(NodeError, match=f"'watchers' is .*'recorder', '{name}'.* is no name"):
        Watchers(made_up, ('recorder', name), 'reference')
    Watchers(made_up, ('recorder', '_hidden', 'my_2nd'), 'reference')
