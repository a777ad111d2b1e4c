"""A law that is an object of one's own in flight: its mistakes, its time, its changes."""

from __future__ import annotations

import math
import sys
import time
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_up_law import NAME, followed, law_of, parameters

from maglev_controller import foreign_law
from maglev_controller.design_process import DesignProcess
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

pytestmark = pytest.mark.usefixtures('law_module')


FAILURES: dict[str, Callable[..., Any]] = {
    "raised KeyError: 'nowhere'": lambda *_: {}['nowhere'],
    'raised SystemExit: 3': lambda *_: sys.exit(3),
    'returned nan for the acceleration of x': lambda *_: [0.0, math.nan, 0.0, 0.0, 0.0],
    'returned -inf for the acceleration of theta': lambda *_: [0.0, 0.0, 0.0, 0.0, -math.inf],
    'returned 1000000.0 for the acceleration of y': lambda *_: [1e6, 0.0, 0.0, 0.0, 0.0],
    'returned shape (2, 4), not (5,)': lambda *_: np.zeros((2, 4)),
    'raised TypeError': lambda *_: object(),
}


QUICK = {'landing.braking_time': 0.2, 'landing.descent_time': 0.4, 'landing.settle_time': 0.05}


class Flight:
    """A supervisor with this law on the simulated stage, carried sideways and down."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.supervisor = supervisor
        start = (0.025, -0.02, 0.0, 0.0, 0.0)
        self.stage = SimulatedStage(build(PlantParameters, {'initial.position': start}))
        self.sequence = -1
        self.states: list[np.ndarray] = []

    def step(self, phase: Phase = Phase.TRACK) -> Mode:
        """One sample."""
        self.sequence += 1
        references, time = self.supervisor.references, min(1e-3 * self.sequence, 0.6)
        position = np.array([0.025 + 0.01 * time, -0.02 + 0.1 * time, 0.0, 0.0, 0.0])
        velocity = np.array([0.01, 0.1, 0.0, 0.0, 0.0])
        if self.sequence == 0:
            phase = Phase.REST
        references.store(self.sequence, phase, 0, position, velocity, np.zeros(5))
        sample = self.stage.read()
        self.supervisor.step(references.find(self.sequence), *sample)
        self.stage.write(self.supervisor.direct_current, self.supervisor.quadrature_current)
        self.states.append(self.stage.state)
        return self.supervisor.mode


@pytest.fixture
def flight() -> Flight:
    """One that has flown for a tenth of a second."""
    made = Flight(Supervisor(build(ControllerParameters, {'law': NAME, **QUICK})))
    for _ in range(100):
        made.step()
    return made


@pytest.mark.parametrize('why', FAILURES)
def test_with_its_first_mistake_the_controller_lands(flight: Flight, why: str) -> None:
    supervisor = flight.supervisor
    law = law_of(supervisor.regulator)
    law.answer = FAILURES[why]
    asked = len(law.told)
    assert flight.step() == Mode.LANDING
    assert why in supervisor.reason
    for _ in range(700):
        flight.step()
        # What lands has run along: it knows what carries the platen, and where that is.
        assert np.abs(supervisor.regulator.error[:3]).max() < 1e-4
    assert len(law.told) == asked + 1
    assert supervisor.mode == Mode.FAULT
    assert why in supervisor.reason
    states = np.array(flight.states)
    assert states[:, 0].min() > 0.0245
    assert flight.stage.state[0] == pytest.approx(0.031, abs=1e-5)
    touched = int(np.argmax(states[:, 0] > 0.0309))
    assert abs(states[touched:, 1]).max() < 0.01
    assert np.abs(states[:, 2]).max() < 0.021


def test_after_a_reset_it_begins_anew(flight: Flight) -> None:
    supervisor = flight.supervisor
    law = law_of(supervisor.regulator)
    law.answer = lambda *_: math.nan
    flight.step()
    assert not supervisor.enable()[0]
    for _ in range(700):
        flight.step()
    law.answer = followed
    resets = law.resets
    assert supervisor.reset_fault()[0]
    assert supervisor.enable()[0]
    flight.step(Phase.REST)
    assert flight.step() == Mode.REGULATING
    assert law.resets == resets + 1
    assert len(law.told) == 1
    assert not supervisor.regulator.fault


def test_a_landing_is_flown_by_the_controllers_own_law(flight: Flight) -> None:
    asked = len(law_of(flight.supervisor.regulator).told)
    flight.supervisor.disable()
    for _ in range(700):
        flight.step()
    assert flight.supervisor.mode == Mode.DISABLED
    assert flight.supervisor.reason == 'landed: disabled'
    assert len(law_of(flight.supervisor.regulator).told) == asked
    assert np.array(flight.states)[:, 0].min() > 0.0245


def test_where_it_loses_the_platen_the_controllers_own_law_lands(flight: Flight) -> None:
    """It answers as it should, and steers aside."""
    supervisor = flight.supervisor
    aside = np.array([0.0, 40.0, 0.0, 0.0, 0.0])
    law_of(supervisor.regulator).answer = lambda m, r: followed(m, r) + aside
    for _ in range(1000):
        flight.step()
        assert supervisor.status != Status.GAVE_UP
    assert 'x is 0.00' in supervisor.reason
    assert "'following.error'" in supervisor.reason
    assert supervisor.mode == Mode.FAULT
    assert flight.stage.state[0] == pytest.approx(0.031, abs=1e-5)
    states = np.array(flight.states)
    touched = int(np.argmax(states[:, 0] > 0.0309))
    assert abs(states[touched:, 1]).max() < 0.01


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """The time that a law takes, in place of that of the machine the tests run on."""
    given = {'now': 0.0, 'takes': 0.0}

    def now() -> float:
        given['now'] += 0.5 * given['takes']
        return given['now']

    monkeypatch.setattr(foreign_law, 'time', types.SimpleNamespace(perf_counter=now))
    return given


def test_it_is_told_how_late_it_was_and_in_the_end_landed(clock: dict[str, float]) -> None:
    supervisor = Supervisor(parameters(foreign__late_samples=3), hurried=True)
    flight = Flight(supervisor)
    for _ in range(10):
        flight.step()
    told = law_of(supervisor.regulator).told
    clock['takes'] = 1.4e-3
    for _ in range(3):
        assert flight.step() == Mode.REGULATING
    clock['takes'] = 0.2e-3
    assert flight.step() == Mode.REGULATING
    assert [measurement.late for measurement, _ in told[-4:]] == pytest.approx(
        [0.0, 2e-4, 2e-4, 2e-4]
    )
    flight.step()
    assert told[-1][0].late == 0.0
    clock['takes'] = 1.4e-3
    for _ in range(3):
        assert flight.step() == Mode.REGULATING
    assert flight.step() == Mode.LANDING
    assert 'took too long 4 times in a row, at last 0.70 ms of the 0.5 ms' in supervisor.reason
    assert supervisor.regulator.foreign is not None
    assert supervisor.regulator.foreign.late == 7
    assert supervisor.regulator.foreign.worst == pytest.approx(0.7e-3)


def test_in_lockstep_nothing_is_late(clock: dict[str, float]) -> None:
    supervisor = Supervisor(parameters(foreign__late_samples=0))
    flight = Flight(supervisor)
    clock['takes'] = 10.0
    for _ in range(20):
        flight.step()
    assert supervisor.mode == Mode.REGULATING
    assert {measurement.late for measurement, _ in law_of(supervisor.regulator).told} == {0.0}


def test_in_flight_the_object_stays_and_on_the_ground_it_is_made_anew(flight: Flight) -> None:
    supervisor = flight.supervisor
    law = law_of(supervisor.regulator)
    law.answer = lambda *given: followed(*given)  # which cannot go to another process
    changed = build(ControllerParameters, {'law': NAME, **QUICK, 'foreign.time': 3e-4})
    regulator = Regulator(changed)
    regulator.foreign = None
    supervisor.adopt(regulator, tuple(np.eye(regulator.arrays.xi.shape[1]) for _ in range(5)))
    assert law_of(supervisor.regulator) is law
    assert flight.step() == Mode.REGULATING
    assert law.told[-1][0].time == 3e-4
    supervisor.disable()
    for _ in range(700):
        flight.step()
    supervisor.adopt(*designed_apart(supervisor, build(ControllerParameters, QUICK)))
    assert supervisor.regulator.foreign is None


@pytest.mark.parametrize('hurried', [True, False])
def test_what_was_designed_apart_is_made_where_it_flies(hurried: bool) -> None:
    supervisor = Supervisor(parameters(), hurried=hurried)
    regulator = Regulator(parameters())
    regulator.foreign = None  # as an object that cannot go to another process
    supervisor.adopt(regulator, tuple(np.eye(regulator.arrays.xi.shape[1]) for _ in range(5)))
    assert supervisor.regulator.foreign is not None
    assert supervisor.regulator.foreign.hurried is hurried


def designed_apart(supervisor: Supervisor, wanted: ControllerParameters) -> tuple[Any, Any]:
    """What the other process designs."""
    process: DesignProcess = supervisor.redesign(wanted)
    while not process.done:
        time.sleep(0.01)
    return process.result()
