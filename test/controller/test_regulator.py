"""The regulator by itself: faults, enabling, jumps of the reference, telemetry."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench import HOVER, ZERO, Bench
from paper_motor import L_h

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault
from maglev_controller.step.sample import answer_sample
from maglev_model.axes import AXES
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.parameters import build, from_yaml, read_yaml, replace, specs

PARAMS = Path(__file__).resolve().parents[2] / 'params'
UNIT_Y = np.eye(5)[0]


def paper() -> ControllerParameters:
    """The paper's regulator."""
    return from_yaml(ControllerParameters, 'controller', PARAMS / 'paper.yaml')


def test_parameter_files_match_the_code() -> None:
    """controller.yaml has every default, but for the machine and other ways to design an axis.

    The overlays build.
    """
    path = PARAMS / 'controller.yaml'
    assert from_yaml(ControllerParameters, 'controller', path) == ControllerParameters()
    left_out = set(specs(ControllerParameters)) - set(read_yaml(path, 'controller'))
    weights = {f'weight_{of}' for of in ('error', 'rate', 'model', 'effort')}
    others = {'design', 'poles_real', 'poles_imaginary', 'antiwindup', *weights}
    machine = {name for name in left_out if name.startswith('machine.')}
    assert left_out - machine == {f'{axis}.{name}' for axis in AXES for name in others}
    exact = from_yaml(
        ControllerParameters, 'controller', path, PARAMS / 'paper.yaml', PARAMS / 'paper_exact.yaml'
    )
    assert (exact.inverse, paper().inverse) == ('exact', 'simplified')
    assert exact.theta.poles_real == exact.phi.poles_real


@pytest.mark.parametrize(
    ('measurement', 'reason'),
    [
        ({'gap': np.nan}, 'not finite'),
        ({'x': np.inf}, 'not finite'),
        ({'z': np.nan}, 'not finite'),
        ({'gap': 0.0325}, r'out of range.*y is 0\.0325'),
        ({'gap': 0.0170}, 'out of range.*y is 0.017'),
        ({'x': 25.0}, 'out of range.*x is 25'),
        ({'z': -0.0512}, 'out of range.*z is -0.0512'),
        ({'gap': [0.0232, 0.025, 0.0268, 0.025]}, 'out of range.*phi is'),
        ({'gap': [0.025, 0.033, 0.025, 0.017]}, 'out of range.*theta is'),
        ({'gap': [0.025, 0.026, 0.025, 0.025]}, 'contradict each other by -0.001 m'),
        ({'gap': [0.025, 0.9, 0.025, 0.025]}, 'not finite|contradict'),
        ({'position': np.array([np.nan, 0, 0, 0, 0.0])}, 'reference is not finite'),
        ({'velocity': np.array([0, np.inf, 0, 0, 0.0])}, 'reference is not finite'),
        ({'acceleration': np.array([0, 0, 1e200, 0, 0.0])}, 'reference is not finite'),
    ],
)
def test_a_fault_gives_no_current_and_leaves_no_trace(
    measurement: dict[str, Any], reason: str
) -> None:
    """Outputs exactly zero; the next good sample answers as if the bad one had not been."""
    struck, spared = Bench(), Bench()
    for k in range(20):
        for bench in (struck, spared):
            bench.step(gap=0.025 + 1e-5 * (k % 3), x=1e-5 * k)
    with pytest.raises(MeasurementFault, match=reason):
        struck.step(**measurement)
    assert not struck.currents.any()
    for bench in (struck, spared):
        bench.step(gap=0.02501, x=2e-4)
    np.testing.assert_array_equal(struck.currents, spared.currents)


def test_a_gap_that_is_none_is_refused() -> None:
    """Stops that are far apart, or a wide margin, let outputs pass of which a motor has no gap.

    The forces (1), (2) mean nothing there, and their inverse was not finite, or silently wrong.
    """
    tilted = Bench(replace(ControllerParameters(), {'machine.theta_max': 0.05}))
    beyond = Bench(replace(ControllerParameters(), {'measurement.margin': 0.1}))
    for bench, gap, number in (
        (tilted, [0.0185, 0.0, 0.0185, 0.037], 2),
        (tilted, [0.0185, 0.038, 0.0185, -0.001], 4),
        (beyond, -0.005, 1),
        (beyond, -0.02, 1),
    ):
        with pytest.raises(MeasurementFault, match=f'gap of motor {number} .* must be above 0'):
            bench.step(gap=gap)
        assert not bench.currents.any()
    tilted.step(gap=[0.0185, 0.001, 0.0185, 0.036])
    assert np.isfinite(tilted.currents).all()


def test_the_rate_of_an_axis_without_control_is_its_own() -> None:
    """A tilt that nobody controls and that stands is seen where it is, standing still.

    Its observer is not told of a w that no current makes.
    """
    left = {'phi.controlled': False, 'theta.controlled': False}
    bench = Bench(replace(ControllerParameters(), left))
    for _ in range(500):
        bench.step(gap=[0.0246, 0.025, 0.0254, 0.025])
    axis, phi = bench.regulator.arrays.axes[AXES.index('phi')], 0.0004 / 0.397
    assert bench.regulator.error_rate[AXES.index('phi')] == pytest.approx(0.0, abs=1e-9)
    assert axis['estimated_position'] == pytest.approx(phi, rel=1e-3)


@pytest.mark.parametrize('parameters', [ControllerParameters(), paper()], ids=['default', 'paper'])
def test_reset_forgets_everything(parameters: ControllerParameters) -> None:
    """After a reset the same samples give the same currents, bit by bit."""
    bench = Bench(parameters)

    def samples() -> np.ndarray:
        rows = []
        for k in range(50):
            bench.step(gap=0.0249 + 1e-6 * k, x=1e-4, z=-1e-5 * k, velocity=ZERO + 1e-3)
            rows.append(bench.currents)
        return np.array(rows)

    first = samples()
    assert not np.array_equal(samples(), first)
    bench.regulator.reset()
    np.testing.assert_array_equal(samples(), first)


def test_enabling_away_from_the_reference_gives_no_kick() -> None:
    """The first answer only carries the weight; the way to the reference begins at rest."""
    near, far = Bench(), Bench()
    near.step(gap=0.028, position=np.array([0.028, 0.0, 0.0, 0.0, 0.0]))
    far.step(gap=0.028, x=0.01, position=HOVER)
    np.testing.assert_allclose(far.direct, near.direct, atol=1e-9)
    np.testing.assert_allclose(far.quadrature, 0.0, atol=1e-12)
    np.testing.assert_allclose(far.regulator.error[:2], [0.003, 0.01])


@pytest.mark.parametrize('name', ['default', 'paper'])
def test_a_jump_of_the_set_point_has_no_rate(name: str) -> None:
    """The estimated error rate stays zero when only the set-point jumps."""
    bench = Bench(paper() if name == 'paper' else None)
    for _ in range(10):
        bench.step()
    bench.step(position=HOVER + 0.003)
    assert abs(bench.regulator.error_rate[0]) < 1e-12
    assert bench.regulator.error[0] == pytest.approx(-0.003)


def test_a_jump_during_another_keeps_the_acceleration() -> None:
    """A set-point that jumps to and fro while the way to it is still being made good."""
    bench = Bench()
    largest = ControllerParameters().jumps.acceleration[1]
    way = 0.03 * np.eye(5)[1]
    found = []
    for k in range(1200):
        axis = bench.regulator.arrays.axes[1]
        bench.step(x=float(axis['smooth_position']), position=HOVER + way)
        if k % 120 == 0:
            way = -way
        found.append(abs(axis['wanted_acceleration']))
    assert 0.9 * largest < max(found) <= largest * (1.0 + 1e-9)


@pytest.mark.parametrize('period', [2.5e-4, 1e-3, 3e-3])
def test_a_reference_without_velocities_may_move_at_0_2_m_s(period: float) -> None:
    for speed, jumps in ((0.19, False), (0.21, period >= 1e-3)):
        bench = Bench(build(ControllerParameters, {'sample_time': period}))
        for k in range(5):
            x = speed * period * k
            bench.step(x=x, position=HOVER + np.array([0.0, x, 0.0, 0.0, 0.0]))
        assert bool(bench.regulator.arrays.axes['transition_duration'][1] > 0.0) == jumps


def test_error_rate_of_a_smooth_reference_is_the_filtered_rate_of_the_error() -> None:
    """Position and reference through the same filter: their difference is that of e itself."""
    bench = Bench(build(ControllerParameters, {'rate_estimate': 'derivative'}))
    gain, forget = bench.regulator.designs[0].derivative
    time = 1e-3 * np.arange(400)
    position = 0.025 + 0.002 * np.sin(9.0 * time)
    velocity = 0.018 * np.cos(9.0 * time)
    measured = 0.025 + 0.0021 * np.sin(9.0 * time + 0.05)
    filtered, wanted, got = measured[0] - position[0], [], []
    for p, v, m in zip(position, velocity, measured, strict=True):
        bench.step(gap=m, position=p * UNIT_Y, velocity=v * UNIT_Y)
        got.append(bench.regulator.error_rate[0])
        wanted.append(gain * (m - p - filtered))
        filtered += forget * (m - p - filtered)
    np.testing.assert_allclose(got[20:], wanted[20:], atol=2e-7)


def test_the_paper_law_is_equations_14_to_17() -> None:
    """w and the internal model of x, saturation included, against the equations written out."""
    parameters = paper()
    bench = Bench(parameters)
    design = bench.regulator.designs[1]
    assert design.model is not None
    K = design.gain - np.array([0.0, 0.0, *design.model.output])
    xi, filtered, sample_time = np.zeros(3), 0.0, parameters.sample_time
    rng = np.random.default_rng(3)
    phi, unit, E = design.model.state, np.array([0.0, 0.0, 1.0]), np.full(3, 7e-5)
    machine = machine_constants(MachineParameters())
    h_x, saturated = -machine.K_h / machine.M_x * 2.0 * L_h(machine, 0.025), 0  # (11)
    for k in range(60):
        error = 0.045 * np.sin(0.3 * k) + 1e-3 * rng.normal()
        bench.step(x=error)
        filtered = error if k == 0 else filtered
        rate = 2000.0 / 3.0 * (error - filtered)
        filtered += 2.0 / 3.0 * (error - filtered)
        w = K @ [error, rate, *xi] + xi[0]
        assert bench.regulator.virtual_input[1] == pytest.approx(w, rel=1e-7, abs=1e-9)
        wanted = w / h_x
        got = bench.quadrature[1]
        assert got == pytest.approx(np.clip(wanted, -7.0, 7.0), rel=1e-7, abs=1e-9)
        saturated += abs(got) == 7.0
        lost = got - wanted
        for _ in range(100):  # the rate of ξ in (17), integrated in small steps
            middle = xi + 0.5 * sample_time / 100 * (phi @ xi + unit * error + E * lost)
            xi = xi + sample_time / 100 * (phi @ middle + unit * error + E * lost)
    assert 5 < saturated < 55


def test_an_axis_without_control_stays_still() -> None:
    """No current, and its internal model does not wind up."""
    bench = Bench(build(ControllerParameters, {'x.controlled': False}))
    for _ in range(100):
        bench.step(x=0.004)
    assert not bench.quadrature.any()
    assert bench.regulator.internal_model[1] == 0.0
    assert bench.regulator.error[1] == 0.004


def test_telemetry_adds_up() -> None:
    """position − reference is the error, and w holds the internal model's share."""
    bench = Bench()
    for k in range(200):
        bench.step(gap=[0.0250, 0.0251, 0.0252, 0.0251], x=1e-4, position=HOVER + 1e-5 * k)
    regulator = bench.regulator
    np.testing.assert_allclose(regulator.error, regulator.position - (HOVER + 1e-5 * 199))
    assert regulator.position[0] == pytest.approx(0.0251)
    assert regulator.internal_model[0] != 0.0


def test_every_order_runs_the_same_machine_code() -> None:
    """Also after a regulator came from another process: nothing is compiled in flight."""
    bench = Bench()
    bench.step()
    compiled = list(answer_sample.signatures)
    assert len(compiled) == 1
    for multiples in ((), (0.0,), (0.0, 1.0, 2.0, 3.0)):
        changes = {f'{axis}.multiples': multiples for axis in AXES}
        other = Bench(build(ControllerParameters, {'margins.override': True, **changes}))
        other.regulator = pickle.loads(pickle.dumps(other.regulator))
        assert not other.step()
    assert list(answer_sample.signatures) == compiled
