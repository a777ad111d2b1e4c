"""What the buttons call, in which order, and what they say of it; the services are made up."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from maglev_node.topics import CURRENTS, MEASUREMENT, REFERENCE
from maglev_view.web.calls import WISHES, Operator
from maglev_view.web.page import BUTTONS

NODES = {CURRENTS: 'controller', MEASUREMENT: 'plant', REFERENCE: 'reference'}


class Service:
    """Answers when it is told to."""

    def __init__(self, name: str) -> None:
        self.srv_name, self.calls, self.ready = name, 0, True
        self.request: Any = None
        self._answer: Any = None

    def service_is_ready(self) -> bool:
        return self.ready

    def call_async(self, request: Any) -> Any:
        self.calls, self.request = self.calls + 1, request
        return SimpleNamespace(done=lambda: self._answer is not None, result=lambda: self._answer)

    def answer(self, success: bool, message: str = '') -> None:
        self._answer = SimpleNamespace(success=success, message=message)


class Graph:
    """Stage, controller and reference in a namespace, and an operator beside them."""

    def __init__(self) -> None:
        self.services: dict[str, Service] = {}
        self.said: list[str] = []
        self.known = True
        self.operator = Operator(self, self.said.append)  # type: ignore[arg-type]
        self.operator.look()

    def get_publishers_info_by_topic(self, topic: str) -> list[Any]:
        if not self.known:
            return []
        return [SimpleNamespace(node_namespace='/lab', node_name=NODES[topic])]

    def create_client(self, _kind: Any, name: str) -> Service:
        return self.services.setdefault(name, Service(name))

    def called(self) -> set[str]:
        return {name for name, service in self.services.items() if service.calls}


@pytest.fixture
def graph(monkeypatch: pytest.MonkeyPatch) -> Graph:
    """Where the operator has been for long."""
    monkeypatch.setattr('maglev_view.web.calls._DISCOVERY', 0.0)
    return Graph()


@pytest.fixture
def wait(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Lets time pass [s]."""

    def passes(duration: float) -> None:
        now = time.monotonic() + duration
        monkeypatch.setattr(time, 'monotonic', lambda: now)

    return passes


def test_every_button_has_its_services() -> None:
    assert set(BUTTONS) == set(WISHES)


def test_an_emergency_stop_is_the_controllers(graph: Graph) -> None:
    graph.operator.ask('Emergency stop', {})
    graph.services['/lab/controller/emergency_stop'].answer(True, 'landing')
    graph.operator.go_on()
    assert graph.called() == {'/lab/controller/emergency_stop'}
    assert graph.said[-1] == '/lab/controller/emergency_stop: landing'


@pytest.mark.parametrize('how', ['silent', 'refused', 'gone'])
def test_where_the_controller_does_not_stop_the_stage_does(
    graph: Graph, how: str, wait: Callable[[float], None]
) -> None:
    controller = graph.services['/lab/controller/emergency_stop']
    controller.ready = how != 'gone'
    graph.operator.ask('Emergency stop', {})
    if how == 'refused':
        controller.answer(False, 'it flies nothing')
    else:
        wait(0.4)
        graph.operator.go_on()
        assert '/lab/plant/emergency_stop' not in graph.called()
        wait(0.2)
    graph.operator.go_on()
    assert '/lab/plant/emergency_stop' in graph.called()
    graph.services['/lab/plant/emergency_stop'].answer(True, 'currents cut')
    graph.operator.go_on()
    assert graph.said[-1].endswith('/lab/plant/emergency_stop: currents cut')


def test_a_reset_is_of_the_stage_and_then_of_the_controller(graph: Graph) -> None:
    graph.operator.ask('Reset', {})
    assert graph.called() == {'/lab/plant/reset'}
    graph.services['/lab/plant/reset'].answer(True)
    graph.operator.go_on()
    graph.services['/lab/controller/reset'].answer(False, 'no fault')
    graph.operator.go_on()
    assert graph.said[-1] == '/lab/plant/reset: done; /lab/controller/reset: no fault'


def test_enable_enables(graph: Graph) -> None:
    graph.operator.ask('Enable', {})
    assert graph.services['/lab/controller/enable'].request.data is True


def test_a_step_is_of_the_axis_and_the_distance_that_were_chosen(graph: Graph) -> None:
    graph.operator.ask('Step', {'axis': 'z', 'distance': -1e-4})
    request = graph.services['/lab/reference/step'].request
    assert (request.axis, request.distance) == ('z', -1e-4)
    graph.services['/lab/reference/step'].answer(False, 'step refused: z is 0.06 m')
    graph.operator.go_on()
    assert graph.said[-1] == '/lab/reference/step: step refused: z is 0.06 m'


def test_what_nobody_offers_is_said_and_not_called_when_it_comes_later(
    graph: Graph, wait: Callable[[float], None]
) -> None:
    for service in graph.services.values():
        service.ready = False
    graph.operator.ask('Lift off', {})
    graph.operator.go_on()
    assert graph.said == ['Lift off …']
    wait(1.1)
    graph.operator.go_on()
    assert graph.said[-1] == f'nobody offers lift_off beside {REFERENCE}'
    graph.services['/lab/reference/lift_off'].ready = True
    graph.operator.go_on()
    assert graph.called() == set()


def test_who_clicks_before_the_nodes_are_known_is_obeyed_once_they_are(
    wait: Callable[[float], None],
) -> None:
    graph = Graph()
    graph.known, graph.operator = False, Operator(graph, graph.said.append)  # type: ignore[arg-type]
    graph.operator.ask('Emergency stop', {})
    wait(4.9)
    graph.operator.go_on()
    assert graph.called() == set()
    graph.known = True
    graph.operator.go_on()
    assert graph.called() == {'/lab/controller/emergency_stop'}


def test_who_has_just_come_up_waits_for_the_controller_before_it_calls_the_stage(
    wait: Callable[[float], None],
) -> None:
    graph = Graph()
    graph.services['/lab/controller/emergency_stop'].ready = False
    graph.operator.ask('Emergency stop', {})
    wait(4.9)
    graph.operator.go_on()
    assert graph.called() == set()
    wait(0.2)
    graph.operator.go_on()
    assert graph.called() == {'/lab/plant/emergency_stop'}


def test_an_emergency_stop_of_the_stage_is_sought_for_long(
    graph: Graph, wait: Callable[[float], None]
) -> None:
    for service in graph.services.values():
        service.ready = False
    graph.operator.ask('Emergency stop', {})
    wait(0.6)
    graph.operator.go_on()
    wait(9.0)
    graph.operator.go_on()
    graph.services['/lab/plant/emergency_stop'].ready = True
    graph.operator.go_on()
    assert graph.called() == {'/lab/plant/emergency_stop'}
