"""Linear models and the nonlinear one for python-control, against the simulator."""

from __future__ import annotations

import builtins
from typing import Any

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, build
from maglev_model.programs.optional import MissingLibraryError
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.linear import CURRENTS, hover_currents, linearise, nonlinear_plant
from maglev_study.references import HOVER, held

control = pytest.importorskip('control', reason='python-control comes with the test tools')

PERIOD = 1e-3
COUNT = 250
SMOOTH = {
    'encoder.gap_resolution': 0.0,
    'encoder.horizontal_resolution': 0.0,
    'guide.coulomb': (0.0,) * 5,
}
LINEAR = {
    'encoder.gap_resolution': 0.0,
    'encoder.horizontal_resolution': 0.0,
    'friction.adaptation_time': 0.0,
    'internal_model.rest': 'hold',
    'jumps.duration': 0.0,
}
AT = np.array([0.024, 0.01, -0.01, 0.0005, 0.002])


def stage_of(**overrides: object) -> PlantParameters:
    """Encoders without counts, no friction but what is given; dots are written as ``__``."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return build(PlantParameters, {**SMOOTH, **named})


@pytest.mark.parametrize('bandwidth', [0.0, 2000.0])
def test_the_open_loop_moves_as_the_simulator_does(bandwidth: float) -> None:
    given = stage_of(
        amplifier__bandwidth=bandwidth, initial__position=tuple(AT), guide__viscous=(0.3,) * 5
    )
    system = linearise(given, AT)
    assert system.input_labels == list(CURRENTS)
    assert system.output_labels == list(AXES)
    assert system.state_labels[:4] == ['y', 'y_rate', 'x', 'x_rate']
    assert system.nstates == (18 if bandwidth else 10)
    moves, hover = [], hover_currents(given, AT)
    pushed = 1e-3 * np.array([1.0, -2.0, 0.5, 0.7, 3.0, 2.0, -3.0, 1.0])
    for push in (np.zeros(8), pushed):
        stage = SimulatedStage(given)
        stage.arrays.flowing[:] = hover
        states = []
        for _ in range(40):
            stage.read()
            states.append(stage.state)
            stage.write((hover + push)[:4], (hover + push)[4:])
        moves.append(np.array(states))
    time = PERIOD * np.arange(40)
    found = control.forced_response(system, time, np.tile(pushed[:, None], (1, 40))).states
    moved = (moves[1] - moves[0]).T
    assert np.abs(moved[0]).max() > 1e-6
    np.testing.assert_allclose(found[:10], moved, rtol=2e-3, atol=2e-3 * np.abs(moved).max())


@pytest.mark.parametrize('off', [{}, {'offset__K_v1': 1.1, 'offset__mass_y': 1.2}])
def test_currents_of_the_hover_hold_it(off: dict[str, float]) -> None:
    """Of a machine whose K's fit each other no more, too."""
    system = nonlinear_plant(stage_of(guide__viscous=(0.3,) * 5, **off))
    currents = hover_currents(stage_of(**off), AT)
    state = np.concatenate((np.stack((AT, np.zeros(5)), axis=1).ravel(), currents))
    np.testing.assert_allclose(system.dynamics(0.0, state, currents), 0.0, atol=1e-10)


@pytest.mark.parametrize('bandwidth', [0.0, 2000.0])
def test_the_nonlinear_plant_moves_as_the_simulator_does(bandwidth: float) -> None:
    """With friction and disturbances, through five millimetres."""
    given = build(
        PlantParameters,
        {
            'amplifier.bandwidth': bandwidth,
            'substeps': 20,
            'initial.position': tuple(AT),
            'disturbance.constant': (1.0, 2.0, 0.0, 0.1, 0.0),
            'disturbance.amplitude': (3.0, 0.0, 5.0, 0.0, 0.1),
            'disturbance.frequency': (20.0,) * 5,
        },
    )
    system = nonlinear_plant(given)
    currents = np.array([0.6, 0.5, 0.55, 0.6, 0.8, -0.7, 0.9, -0.4])
    stage = SimulatedStage(given)
    states = []
    for _ in range(31):
        stage.read()
        states.append(stage.state)
        stage.write(currents[:4], currents[4:])
    start = np.zeros(system.nstates)
    start[:10] = states[0]
    found = control.input_output_response(
        system,
        PERIOD * np.arange(31),
        np.tile(currents[:, None], (1, 31)),
        start,
        solve_ivp_kwargs={'rtol': 1e-9, 'atol': 1e-12},
    )
    simulated = np.array(states)
    assert np.abs(simulated[-1] - simulated[0]).max() > 1e-2
    np.testing.assert_allclose(found.states[:10].T, simulated, rtol=1e-5, atol=2e-8)
    np.testing.assert_array_equal(found.outputs, found.states[:10:2])


@pytest.mark.parametrize(
    ('changes', 'known'),
    [
        ({'amplifier.bandwidth': 0.0}, {}),
        ({'amplifier.bandwidth': 2000.0, 'guide.viscous': (0.5,) * 5}, {'input_delay': 1}),
        (
            {'amplifier.bandwidth': 500.0, 'offset.K_v1': 1.1, 'offset.spring_theta': 0.7},
            {'rate_estimate': 'derivative'},
        ),
        ({'amplifier.bandwidth': 0.0}, {'inverse': 'simplified'}),
    ],
)
def test_each_closed_loop_answers_as_the_simulator_does(
    changes: dict[str, object], known: dict[str, object]
) -> None:
    """To a disturbance, and to a set-point that jumps by a little."""
    hover = {'initial.position': tuple(HOVER)}
    given = build(PlantParameters, {**SMOOTH, **changes, **hover})
    law = build(ControllerParameters, {**LINEAR, **known})
    flight = Hover(given, law)
    for index, axis in enumerate(AXES):
        loop = linearise(given, axis=axis, controller=law)
        assert loop.dt == PERIOD
        assert loop.output_labels == [axis, 'error', 'w']
        assert np.abs(np.linalg.eigvals(loop.A)).max() < 1.0
        push, way = np.zeros(5), np.zeros(5)
        push[index], way[index] = 2e-4, 1e-6
        pushed = flight.moved(push, np.zeros(5))[:, index]
        compare(pushed, response(loop['error', 'disturbance'], 2e-4))
        stepped = flight.moved(np.zeros(5), way)[:, index]
        compare(stepped, response(loop[axis, 'reference'], 1e-6))


def test_an_axis_is_as_stiff_as_its_currents_make_it() -> None:
    """Of a platen that stoppers carry they are others than those that would."""
    place = np.array([0.028, 0.0, 0.0, 0.0, 0.012])
    given = stage_of(initial__position=tuple(place), guide__locked=(True,) * 4 + (False,))
    law = build(
        ControllerParameters,
        {**LINEAR, 'theta.bandwidth': 100.0, 'theta.integration': 30.0}
        | {f'{axis}.controlled': False for axis in AXES[:4]},
    )
    push = np.array([0.0, 0.0, 0.0, 0.0, 2e-4])
    pushed = Hover(given, law, place).moved(push, np.zeros(5))[:, 4]
    loop = linearise(given, place, axis='theta', controller=law)
    compare(pushed, response(loop['error', 'disturbance'], 2e-4))


def response(system: Any, step: float) -> np.ndarray:
    """The output of a sampled system."""
    time = PERIOD * np.arange(COUNT)
    return np.array(control.forced_response(system, time, np.full(COUNT, step)).outputs)


def compare(found: np.ndarray, wanted: np.ndarray) -> None:
    """Within a thousandth of the largest."""
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-3 * np.abs(wanted).max())


class Hover:
    """A flight that hovers, and can be pushed again and again."""

    def __init__(
        self, given: PlantParameters, law: ControllerParameters, place: np.ndarray = HOVER
    ) -> None:
        self.stage, self.regulator, self.place = SimulatedStage(given), Regulator(law), place
        self.delayed = law.input_delay > 0
        run(self.regulator, self.stage, held(place, 0.7, PERIOD), delayed=self.delayed)
        self.saved = self.stage.arrays.block.copy(), self.regulator.save()
        self.still = self.go_on(np.zeros(5), np.zeros(5))

    def go_on(self, push: np.ndarray, way: np.ndarray) -> np.ndarray:
        """The outputs with a disturbance [m/s², rad/s²], the set-point moved by a way."""
        self.stage.arrays.block[:] = self.saved[0]
        self.regulator.restore(self.saved[1])
        self.stage.arrays.constant[:] += push
        references = held(self.place + way, PERIOD * COUNT, PERIOD)
        return run(self.regulator, self.stage, references, delayed=self.delayed).output

    def moved(self, push: np.ndarray, way: np.ndarray) -> np.ndarray:
        """The same, less what would have been without."""
        return self.go_on(push, way) - self.still


def test_a_law_with_notches_has_them_in_its_loop() -> None:
    modes = {'modes.axis': ('x',), 'modes.frequency': (120.0,), 'modes.damping': (0.01,)}
    law = build(ControllerParameters, {**modes, 'modes.gain': (0.3,)})
    loop = linearise(stage_of(), axis='x', controller=law)
    assert [name for name in loop.state_labels if name.startswith('notch')]
    assert np.abs(np.linalg.eigvals(loop.A)).max() < 1.0


@pytest.mark.parametrize(
    ('call', 'why'),
    [
        (
            lambda: linearise(at=(25.0, 0.0, 0.0, 0.0, 0.0)),
            r'y at 25 m, .*\[0\.018, 0\.031\] m, is',
        ),
        (lambda: linearise(at=(0.025, 0.0)), r"'at' has shape \(2,\), it takes \(5,\): y, x, z"),
        (lambda: linearise({'seed': 3}), r"'plant' is a dict, it takes PlantParameters: .*build"),
        (lambda: linearise(axis='w'), r"'axis' is 'w', it must be one of y, x, z, phi, theta"),
        (
            lambda: linearise(axis='x', controller=PlantParameters()),
            "'controller' is a PlantParameters, it takes ControllerParameters",
        ),
        (
            lambda: linearise(build(PlantParameters, {'effects.friction.model': 'lugre'})),
            r"'effects\.\*' of the plant",
        ),
        (
            lambda: linearise(build(PlantParameters, {'sample_time': 2e-3}), axis='x'),
            "'sample_time' of the plant is 0.002 s",
        ),
        (
            lambda: linearise(
                axis='phi', controller=build(ControllerParameters, {'phi.controlled': False})
            ),
            r"'phi\.controlled' is false",
        ),
    ],
)
def test_what_cannot_be_linearised(call: Any, why: str) -> None:
    with pytest.raises((ParameterError, TypeError, ValueError), match=why):
        call()


def test_without_python_control_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    there = builtins.__import__

    def without(name: str, *others: Any) -> Any:
        if name == 'control':
            raise ModuleNotFoundError(name)
        return there(name, *others)

    monkeypatch.setattr(builtins, '__import__', without)
    with pytest.raises(MissingLibraryError, match=r'needs control: /.* pip install control'):
        linearise()
