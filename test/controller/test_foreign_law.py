"""Laws that are objects of one's own: what they are told, what becomes of their answers."""

from __future__ import annotations

import math
import sys
import time
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from maglev_controller import foreign_law
from maglev_controller.design_process import DesignProcess
from maglev_controller.foreign_law import Measurement, Reference
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_controller.supervision import Supervisor
from maglev_model.controller_watch import Status
from maglev_model.currents import exact_currents
from maglev_model.inverse import CURRENT, CurrentLimits
from maglev_model.machine import machine_constants
from maglev_model.modes import Mode
from maglev_model.parameters import ParameterError, build
from maglev_model.phases import Phase
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

STOP = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
NAME = 'made_up_laws.mine'


class Made:
    """A law that answers as it is told to; by itself as the project's own linear feedback."""

    def __init__(self) -> None:
        self.answer: Callable[[Measurement, Reference], Any] = followed
        self.told: list[tuple[Measurement, Reference]] = []
        self.resets = 0

    def reset(self) -> None:
        self.resets += 1
        self.told.clear()

    def step(self, measurement: Measurement, reference: Reference) -> Any:
        self.told.append((measurement, reference))
        return self.answer(measurement, reference)


def followed(measurement: Measurement, reference: Reference) -> np.ndarray:
    """A double integrator's state feedback."""
    error = measurement.position - reference.position
    rate = measurement.velocity - reference.velocity
    return reference.acceleration - 1e4 * error - 150.0 * rate


@pytest.fixture(autouse=True)
def module() -> Iterator[types.ModuleType]:
    """The module of the law; its ``make`` can be another one."""
    package, mine = types.ModuleType('made_up_laws'), types.ModuleType(NAME)
    package.__path__ = []
    mine.make = lambda _: Made()  # type: ignore[attr-defined]
    sys.modules |= {'made_up_laws': package, NAME: mine}
    yield mine
    del sys.modules[NAME], sys.modules['made_up_laws']


def parameters(**overrides: object) -> ControllerParameters:
    """Of the controller with this law; dots are written as ``__``."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return build(ControllerParameters, {'law': NAME, **named})


def law_of(regulator: Regulator) -> Made:
    """The object that the regulator asks."""
    assert regulator.foreign is not None
    assert isinstance(regulator.foreign.law, Made)
    return regulator.foreign.law


def step(
    regulator: Regulator, position: np.ndarray, reference: np.ndarray = HOVER
) -> tuple[int, np.ndarray]:
    """What limits, and the currents (2, 4), for a level platen."""
    currents, zero = np.zeros((2, 4)), np.zeros(5)
    gap, x, z = np.full(4, position[0]), float(position[1]), float(position[2])
    code = regulator.step(gap, x, z, reference, zero, zero, currents[0], currents[1])
    return code, currents


# -- what it answers -------------------------------------------------------------------------------


def test_accelerations_become_currents_by_the_inverse() -> None:
    regulator = Regulator(parameters())
    wanted = np.array([0.5, -0.4, 0.3, 0.2, -0.1])
    law_of(regulator).answer = lambda *_: wanted
    code, found = step(regulator, HOVER)
    limits = CurrentLimits(7.0, 1.0, 0.1, 0.5)
    machine = machine_constants(regulator.parameters.machine)
    direct, quadrature, possible = exact_currents(machine, HOVER[None], wanted[None], limits)
    assert code == 0
    assert possible.all()
    np.testing.assert_array_equal(found, [direct[0], quadrature[0]])
    np.testing.assert_array_equal(regulator.virtual_input, wanted)


def test_currents_are_taken_as_they_are_within_their_amplitude(module: types.ModuleType) -> None:
    asked = np.array([[1.0, -2.0, 6.0, 9.0], [0.5, 1.0, 6.0, 1.0]])
    module.make = lambda _: made_to(lambda *_: asked)
    code, found = step(Regulator(parameters()), HOVER)
    left = math.sqrt(7.0**2 - 6.0**2)
    assert code == CURRENT
    np.testing.assert_allclose(found, [[1.0, -2.0, 6.0, 7.0], [0.5, 1.0, left, 0.0]], atol=1e-12)
    asked *= 0.5
    code, found = step(Regulator(parameters()), HOVER)
    assert code == 0
    np.testing.assert_array_equal(found, asked)


def made_to(answer: Callable[..., Any]) -> Made:
    """A law with an answer of its own."""
    law = Made()
    law.answer = answer
    return law


def test_what_it_is_told() -> None:
    regulator = Regulator(parameters(foreign__time=4e-4))
    velocity = np.array([-0.002, 0.003, 0.0, 0.0, 0.0])
    law_of(regulator).answer = lambda *_: np.zeros(5)
    for k in range(400):
        step(regulator, HOVER + 1e-3 * k * velocity, HOVER)
    measurement, reference = law_of(regulator).told[-1]
    position = HOVER + 0.399 * velocity
    np.testing.assert_allclose(measurement.gap, position[0])
    assert (measurement.x, measurement.z) == (position[1], 0.0)
    np.testing.assert_allclose(measurement.position, position)
    np.testing.assert_allclose(measurement.velocity, velocity, atol=1e-9)
    assert (measurement.time, measurement.late) == (4e-4, 0.0)
    np.testing.assert_allclose(reference.position, HOVER)
    assert not np.any(reference.velocity)
    step(regulator, position, HOVER + 0.002)  # a raw step, which is rounded off
    jumped = law_of(regulator).told[-1][1]
    np.testing.assert_allclose(jumped.position, HOVER, atol=1e-6)
    for _ in range(100):
        step(regulator, position, HOVER + 0.002)
    halfway = law_of(regulator).told[-1][1]
    np.testing.assert_allclose(halfway.position, HOVER + 0.001, atol=1e-6)
    assert np.all(halfway.velocity > 0.01)


def test_what_it_is_told_is_its_own_to_change() -> None:
    spoilt, kept = Regulator(parameters()), Regulator(parameters())

    def spoil(measurement: Measurement, reference: Reference) -> np.ndarray:
        answer = followed(measurement, reference)
        for array in (measurement.gap, measurement.position, measurement.velocity, *reference):
            array[:] = math.nan
        return answer

    law_of(spoilt).answer = spoil
    for k in range(5):
        position = HOVER + 1e-5 * k
        np.testing.assert_array_equal(step(spoilt, position)[1], step(kept, position)[1])


# -- what is refused before anything moves ---------------------------------------------------------


@pytest.mark.parametrize(
    ('answer', 'why'),
    [
        (lambda *_: np.zeros(4), r'of shape \(4,\): it must be \(2, 4\), currents'),
        (lambda *_: None, r'of shape \(\)'),
        (
            lambda *_: 1.0 / 0.0,
            r'at rest .* raised ZeroDivisionError: .*test_foreign_law\.py, line',
        ),
        (lambda *_: 'nothing', r'raised ValueError'),
    ],
)
def test_an_answer_that_is_none(module: types.ModuleType, answer: Any, why: str) -> None:
    module.make = lambda _: made_to(answer)
    with pytest.raises(ParameterError, match=why):
        Regulator(parameters())


def test_a_law_that_cannot_be_made(module: types.ModuleType) -> None:
    module.make = lambda _: [][0]
    with pytest.raises(ParameterError, match=rf"'law' is '{NAME}', which cannot be made: IndexErr"):
        Regulator(parameters())


def test_choices_that_contradict_it(module: types.ModuleType) -> None:
    with pytest.raises(ParameterError, match=r"'foreign\.time' is 0\.002 s, .*0\.001 s"):
        Regulator(parameters(foreign__time=2e-3))
    with pytest.raises(ParameterError, match=r"'inverse' is 'equilibrium', .* lands by itself"):
        Regulator(parameters(inverse='equilibrium'))

    def check(_: ControllerParameters) -> None:
        raise ParameterError('not on a Sunday')

    module.check = check
    with pytest.raises(ParameterError, match='not on a Sunday'):
        Regulator(parameters())


# -- what becomes of one that fails ----------------------------------------------------------------


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
        references, time = self.supervisor.references, 1e-3 * self.sequence
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


def test_control_c_is_not_a_mistake() -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    regulator = Regulator(parameters())
    law_of(regulator).answer = interrupt
    with pytest.raises(KeyboardInterrupt):
        step(regulator, HOVER)


# -- the time it takes -----------------------------------------------------------------------------


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


# -- changes ---------------------------------------------------------------------------------------


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
