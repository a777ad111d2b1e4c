"""Regulator and simulated stage together: the paper's figures, and the default's."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import control
import numpy as np
import pytest

from maglev_controller.design.gains import augmented
from maglev_controller.landing import Landing
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import PHI, THETA, X, Y, Z
from maglev_model.parameters import build, read_yaml
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import Run, run
from maglev_study.references import HOVER, References, ellipse, held, joined, shaped

PARAMS = Path(__file__).resolve().parents[2] / 'params'
PERIOD = 1e-3


def regulator(*overlays: str, **overrides: object) -> Regulator:
    """The default regulator, or one with overlays from params/."""
    found: dict[str, object] = {}
    for name in overlays:
        found.update(read_yaml(PARAMS / name, 'controller'))
    found.update({name.replace('__', '.'): value for name, value in overrides.items()})
    return Regulator(build(ControllerParameters, found))


def stage(overlay: str, position: np.ndarray, **overrides: object) -> SimulatedStage:
    """A stage with an overlay from params/, at rest at a position (5,)."""
    found = read_yaml(PARAMS / overlay, 'plant')
    found.update({name.replace('__', '.'): value for name, value in overrides.items()})
    found['initial.position'] = tuple(position)
    return SimulatedStage(build(PlantParameters, found))


class Step(NamedTuple):
    """A step response as the paper judges it."""

    overshoot: float  # [%]
    settling: float  # error goes and stays below 0.1 mm, mrad [s]
    encoder: float  # and below 10 µm, 20 µrad [s]


def judge(response: np.ndarray, start: float, end: float, tilt: bool) -> Step:
    """Overshoot, t_s and t_enc of a response that begins with the step."""
    error = np.abs(response - end)

    def last_above(bound: float) -> float:
        above = np.nonzero(error > bound)[0]
        return PERIOD * (above[-1] + 1) if above.size else 0.0

    overshoot = max(0.0, float(np.max((response - end) / (end - start)))) * 100.0
    return Step(overshoot, last_above(1e-4), last_above(2e-5 if tilt else 1e-5))


def raw_step(reg: Regulator, plant: str, axis: int, start: float, end: float, hold: float) -> Step:
    """A raw step from rest, the regulator enabled with it."""
    position, target = HOVER.copy(), HOVER.copy()
    position[axis], target[axis] = start, end
    outcome = run(reg, stage(plant, position), held(target, hold, PERIOD))
    return judge(outcome.output[:, axis], start, end, axis >= PHI)


def mean_error(outcome: Run, references: References, last: float) -> np.ndarray:
    """Mean |e| (5,) over the last seconds [µm, µrad]."""
    n = round(last / PERIOD)
    error = np.abs(outcome.output - references.position)[-n:]
    return np.asarray(1e6 * error.mean(axis=0))


def test_paper_on_the_ideal_plant() -> None:
    """Overshoot and settling of the paper's regulator on its own model."""
    lifted = raw_step(regulator('paper.yaml'), 'ideal.yaml', Y, 0.020, 0.027, 6.0)
    assert lifted.overshoot == pytest.approx(16.0, abs=1.0)
    assert lifted.settling == pytest.approx(2.0, abs=0.1)
    tilted = raw_step(regulator('paper.yaml'), 'ideal.yaml', THETA, 0.0, 0.010, 6.0)
    assert tilted.overshoot == pytest.approx(22.0, abs=1.5)
    moved = raw_step(regulator('paper.yaml'), 'ideal.yaml', X, 0.0, 0.030, 6.0)
    assert moved.overshoot == pytest.approx(23.7, abs=1.0)


def test_paper_step_in_flight_on_the_ideal_plant() -> None:
    """After holding 20 mm, restarted at the step as ``restart_at_step`` does: as from rest."""
    low, high = np.array([0.020, 0.0, 0.0, 0.0, 0.0]), np.array([0.027, 0.0, 0.0, 0.0, 0.0])
    reg, plant = regulator('paper.yaml'), stage('ideal.yaml', HOVER)
    assert reg.parameters.internal_model.restart_at_step
    run(reg, plant, shaped(HOVER, low, 2.0, 8.0, PERIOD))
    reg.reset()
    step = judge(run(reg, plant, held(high, 6.0, PERIOD)).output[:, Y], 0.020, 0.027, False)
    assert step.overshoot == pytest.approx(16.0, abs=1.0)
    assert step.settling == pytest.approx(2.0, abs=0.1)


def test_exact_inverse_makes_the_loop_linear() -> None:
    """On the ideal plant a vertical step is the linear closed loop's, by python-control."""
    reg = regulator('paper.yaml', 'paper_exact.yaml')
    design = reg.designs[Y]
    assert design.model is not None
    state, drive = augmented(design.model)
    feedback = design.gain - np.array([0.0, 0.0, *design.model.output])  # Γ ξ is in the state
    closed = control.ss(
        state + np.outer(drive, feedback), np.zeros((5, 1)), np.eye(1, 5), np.zeros((1, 1))
    )
    time = PERIOD * np.arange(4000)
    for start, end in ((0.020, 0.027), (0.027, 0.022)):
        wanted = control.initial_response(closed, time, [start - end, 0, 0, 0, 0]).outputs
        position, target = HOVER.copy(), HOVER.copy()
        position[Y], target[Y] = start, end
        reg.reset()
        outcome = run(reg, stage('ideal.yaml', position), held(target, 4.0, PERIOD))
        distance = np.abs(outcome.output[:, Y] - end - wanted).max()
        assert distance < 0.015 * abs(end - start)


@pytest.mark.parametrize('theta', [0.0, 0.010])
def test_paper_errors_on_the_benchmark_plant(theta: float) -> None:
    """The errors the paper measured, over 60 s, within a tenth; the default is far below them."""
    references = ellipse(66.0, theta, PERIOD)
    reg = regulator('paper.yaml', 'paper_exact.yaml')
    outcome = run(reg, stage('benchmark.yaml', references.position[0]), references)
    paper = mean_error(outcome, references, 60.0)
    np.testing.assert_allclose(paper[:PHI], [33.0, 78.0, 68.0], rtol=0.1)
    if theta:
        assert paper[THETA] == pytest.approx(124.0, rel=0.1)
    outcome = run(regulator(), stage('benchmark.yaml', references.position[0]), references)
    ours = mean_error(outcome, references, 60.0)
    assert np.all(ours < [2.0, 2.0, 2.0, 0.5, 7.0])


def test_paper_step_on_the_benchmark_plant() -> None:
    """Fig. 4: 14.3 % overshoot, below 0.1 mm within 3 s, at encoder resolution in about 5 s."""
    step = raw_step(
        regulator('paper.yaml', 'paper_exact.yaml'), 'benchmark.yaml', Y, 0.020, 0.027, 8.0
    )
    assert 12.0 < step.overshoot < 15.0
    assert step.settling < 3.0
    assert step.encoder == pytest.approx(5.0, abs=0.5)


TABLE_III = [
    (Y, 0.020, 0.027),
    (Y, 0.030, 0.025),
    (Y, 0.025, 0.030),
    (X, 0.0, 0.030),
    (Z, 0.0, 0.030),
    (X, -0.030, 0.030),
    (THETA, 0.0, 0.005),
    (THETA, 0.0, 0.010),
    (THETA, -0.010, 0.010),
]


@pytest.mark.parametrize('raw', [True, False], ids=['raw', 'shaped'])
@pytest.mark.parametrize(('axis', 'start', 'end'), TABLE_III)
def test_default_steps(axis: int, start: float, end: float, raw: bool) -> None:
    """Table III and more, at a tenth of its times, raw or shaped over 0.2 s, in one run."""
    begin, target = HOVER.copy(), HOVER.copy()
    begin[axis], target[axis] = start, end
    way = 4.0 if raw else 0.2
    second = held(target, 4.0, PERIOD) if raw else shaped(begin, target, way, 4.0, PERIOD)
    references = joined(held(begin, 1.0, PERIOD), second)
    outcome = run(regulator(), stage('benchmark.yaml', begin), references)
    step = judge(outcome.output[1000:, axis], start, end, axis >= PHI)
    assert step.overshoot < 1.0
    assert step.settling < 0.32
    assert step.encoder < 0.65
    others = np.delete(np.abs(outcome.output - begin), axis, axis=1)
    assert np.all(others.max(axis=0) < 6e-5)


@pytest.mark.parametrize(
    'offset',
    [
        {'offset__K_v1': 1.1, 'offset__K_v2': 1.1, 'offset__K_v3': 1.1, 'offset__K_h': 1.1},
        {'offset__K_v1': 0.9, 'offset__K_v2': 0.9, 'offset__K_v3': 0.9, 'offset__K_h': 0.9},
        {'offset__mass_y': 1.1, 'offset__mass_x': 1.1, 'offset__mass_z': 1.1},
        {'offset__mass_y': 0.9, 'offset__mass_x': 0.9, 'offset__mass_z': 0.9},
        {'offset__K_v2': 0.9, 'offset__spring_theta': 1.3, 'offset__inertia': 1.1},
        {'offset__K_v1': 1.1, 'offset__K_h': 0.9, 'offset__spring_phi': 0.7},
    ],
)
def test_default_on_another_plant_than_it_knows(offset: dict[str, float]) -> None:
    """10 % off in forces or masses, 30 % in springs: the ellipse's errors hardly change."""
    references = ellipse(16.0, 0.010, PERIOD)
    outcome = run(
        regulator(), stage('benchmark.yaml', references.position[0], **offset), references
    )
    assert np.all(mean_error(outcome, references, 8.0) < [2.5, 2.2, 2.2, 1.0, 8.0])


def test_a_delayed_run_is_one_whose_currents_come_a_sample_late() -> None:
    """Against the loop written out."""
    references = ellipse(0.5, 0.010, PERIOD)
    delayed = run(
        regulator(), stage('benchmark.yaml', references.position[0]), references, delayed=True
    )
    plant, reg = stage('benchmark.yaml', references.position[0]), regulator()
    direct, quadrature = np.zeros((2, 4)), np.zeros((2, 4))
    for k, reference in enumerate(zip(*references, strict=True)):
        sample = plant.read()
        np.testing.assert_array_equal(plant.state, delayed.state[k])
        reg.step(*sample, *reference, direct[k % 2], quadrature[k % 2])
        plant.write(direct[(k + 1) % 2], quadrature[(k + 1) % 2])


def test_standstill_after_a_move_stays_within_the_encoders() -> None:
    """Friction, counts and integral action together: within a count and a half for 10 s."""
    start, goal = HOVER, np.array([0.0243, 0.0123, -0.0071, 0.0004, 0.0052])
    references = shaped(start, goal, 1.0, 15.0, PERIOD)
    outcome = run(regulator(), stage('benchmark.yaml', start), references)
    error = np.abs(outcome.output - goal)[-10_000:].max(axis=0)
    assert np.all(error < [1e-5, 1e-5, 1e-5, 2e-5, 2e-5])


@pytest.mark.parametrize('overlays', [(), ('paper.yaml', 'paper_exact.yaml'), ('paper.yaml',)])
def test_lift_off_and_landing(overlays: tuple[str, ...]) -> None:
    """From the stop to 25 mm without touching the other one, and softly back by the controller."""
    floor = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
    plant, reg = stage('benchmark.yaml', floor), regulator(*overlays)
    lifted = run(reg, plant, shaped(floor, HOVER, 1.5, 4.0, PERIOD))
    assert abs(lifted.output[-1, Y] - 0.025) < 2e-4
    assert lifted.output[:, Y].min() > 0.023
    landing = Landing(reg.parameters, HOVER, np.zeros(5), np.zeros(5))
    rows = []
    while not landing.done:
        rows.append(landing.step())
    landed = run(reg, plant, References(*(np.array(part) for part in zip(*rows, strict=True))))
    touched = np.nonzero(landed.output[:, Y] > 0.031 - 1e-6)[0]
    speed = landed.state[touched[0] - 1, 1] if touched.size else 0.0
    assert abs(speed) < 3e-3
    plant.write(np.zeros(4), np.zeros(4))
    for _ in range(500):
        plant.read()
    assert plant.state[0] == pytest.approx(0.031, abs=1e-6)
    assert abs(plant.state[1]) < 1e-6


@pytest.mark.parametrize('axis', [X, Z])
def test_a_saturated_axis_comes_back(axis: int) -> None:
    """Thrown 40 mm off without shaping: held up, and back in place at a speed it can brake."""
    start, far = HOVER.copy(), HOVER.copy()
    far[axis] = 0.040
    anything = (1.0,) * 5
    held_to = (5e-4, 5e-4, 5e-4, 1.5e-3, 1.5e-3)
    for bound in (held_to, anything) if axis == X else (held_to,):  # z gets away without, by luck
        reg = regulator(limits__error=bound, jumps__duration=0.0)
        outcome = run(reg, stage('benchmark.yaml', start), held(far, 4.0, PERIOD))
        error = np.abs(outcome.output[-500:] - far).max(axis=0)
        assert (error[axis] < 1e-5) == (bound != anything)
        assert np.abs(outcome.output[:, Y] - 0.025).max() < 5e-4


def test_two_runs_are_bit_identical_and_equal_the_stepwise_loop() -> None:
    """Also when the run is cut in two, and when the nodes' way of stepping is taken."""
    references = ellipse(1.5, 0.010, PERIOD)
    first = run(regulator(), stage('benchmark.yaml', references.position[0]), references)
    reg, plant = regulator(), stage('benchmark.yaml', references.position[0])
    parts = [
        run(reg, plant, References(*(array[part] for array in references)))
        for part in (slice(0, 700), slice(700, None))
    ]
    np.testing.assert_array_equal(np.concatenate([part.state for part in parts]), first.state)
    reg, plant = regulator(), stage('benchmark.yaml', references.position[0])
    direct, quadrature = np.zeros(4), np.zeros(4)
    for k, reference in enumerate(zip(*references, strict=True)):
        sample = plant.read()
        np.testing.assert_array_equal(plant.state, first.state[k])
        limited_by = reg.step(*sample, *reference, direct, quadrature)
        np.testing.assert_array_equal(direct, first.direct_current[k])
        np.testing.assert_array_equal(quadrature, first.quadrature_current[k])
        assert limited_by == first.limited_by[k]
        plant.write(direct, quadrature)


def test_bad_references_are_named() -> None:
    """A wrong shape, and a sample the regulator refuses."""
    references = held(HOVER, 0.1, PERIOD)
    with pytest.raises(ValueError, match=r'velocity must have shape \(100, 5\), not \(99, 5\)'):
        run(
            regulator(),
            stage('ideal.yaml', HOVER),
            references._replace(velocity=references.velocity[1:]),
        )
    references.position[40, 1] = np.nan
    with pytest.raises(MeasurementFault, match='sample 40: the reference is not finite'):
        run(regulator(), stage('ideal.yaml', HOVER), references)
