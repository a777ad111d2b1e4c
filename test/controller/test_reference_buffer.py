"""The references that wait for their sample, when stage or reference begin anew."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase

REST = np.array([0.031, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture(scope='module')
def shared() -> Supervisor:
    return Supervisor(ControllerParameters())


@pytest.fixture
def supervisor(shared: Supervisor) -> Supervisor:
    shared.references.clear()
    return shared


def publish(supervisor: Supervisor, first: int, count: int = 64) -> None:
    for sequence in range(first, first + count):
        supervisor.references.store(sequence, Phase.REST, 0, REST, np.zeros(5), np.zeros(5))


def answer(supervisor: Supervisor, sequence: int) -> bool:
    row = supervisor.references.find(sequence)
    supervisor.step(row, np.full(4, REST[0]), 0.0, 0.0)
    assert supervisor.mode is Mode.WAITING
    return row >= 0


def held(supervisor: Supervisor) -> list[int]:
    return sorted(int(s) for s in supervisor.references.sequence if s >= 0)


def test_the_newest_are_held(supervisor: Supervisor) -> None:
    capacity = supervisor.references.capacity
    publish(supervisor, 0, capacity + 10)
    assert held(supervisor) == list(range(10, capacity + 10))
    assert supervisor.references.find(9) == -1
    assert supervisor.references.newest == capacity + 9


def test_nothing_is_found_where_nothing_is(supervisor: Supervisor) -> None:
    publish(supervisor, 0, 2000)
    supervisor.references.clear()
    assert supervisor.references.find(supervisor.references.newest) == -1


@pytest.mark.parametrize('length', [20, 5000])
def test_the_stage_is_seen_anew_first(supervisor: Supervisor, length: int) -> None:
    publish(supervisor, 0, length + 64)
    assert answer(supervisor, length)
    supervisor.restart()
    assert held(supervisor) == []
    publish(supervisor, 0)
    assert answer(supervisor, 0)


@pytest.mark.parametrize('length', [20, 5000])
def test_the_reference_is_seen_anew_first(supervisor: Supervisor, length: int) -> None:
    publish(supervisor, 0, length + 64)
    assert answer(supervisor, length)
    publish(supervisor, 0)
    supervisor.restart()
    assert held(supervisor) == list(range(64))
    assert answer(supervisor, 0)


def test_after_another_reference_comes_another_stage(supervisor: Supervisor) -> None:
    publish(supervisor, 0, 364)
    assert answer(supervisor, 300)
    publish(supervisor, 310)
    assert answer(supervisor, 310)
    supervisor.restart()
    assert held(supervisor) == []
