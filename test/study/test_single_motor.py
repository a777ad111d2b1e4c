"""The single-motor machine of refs. [10], [11]: its plant, its inverse, its flights."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.inverse import CURRENT, LEVITATION, Answer, CurrentLimits, exact_inverse
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import attraction_coefficients, horizontal_force, vertical_force
from maglev_model.parameters import ParameterError, build, from_yaml, replace
from maglev_model.phases import Phase
from maglev_model.platen import accelerations
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline
from maglev_study.closed_loop import run
from maglev_study.references import References

PARAMS = Path(__file__).resolve().parents[2] / 'params'
SINGLE = MachineParameters(motors=1, mass_y=1.725, mass_x=5.3)
MACHINE = machine_constants(SINGLE)
BOTH = np.array([1.0, 1.0, 0.0, 0.0, 0.0])

gaps = st.floats(0.0185, 0.0305)


def inverse(
    gap: float, w_y: float, w_x: float, limits: CurrentLimits
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Currents i_d, i_q, realised accelerations, and what limited them."""
    output, wanted = np.zeros(5), np.zeros(5)
    output[0], wanted[0], wanted[1] = gap, w_y, w_x
    direct, quadrature, realised, excess = (np.full(n, 9.0) for n in (4, 4, 5, 2))
    answer = Answer(direct, quadrature, realised, excess)
    limited = exact_inverse(MACHINE, limits, BOTH, output, wanted, answer)
    return direct, quadrature, realised, limited


@settings(max_examples=60, deadline=None)
@given(gaps, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_it_is_four_motors_that_carry_four_and_two_times_the_mass(
    gap: float, i_d: float, i_q: float
) -> None:
    """One motor with (1), (2) is all four of (6) with equal currents, per its share of mass."""
    four = machine_constants(MachineParameters(mass_y=4.0 * 1.725, mass_x=2.0 * 5.3))
    state, single, full = np.zeros(10), np.empty(5), np.empty(5)
    state[0] = gap
    only = np.array([0.0, 1.0, 0.0, 0.0])
    accelerations(MACHINE, state, i_d * only, i_q * only, single)
    accelerations(four, state, np.full(4, i_d), np.full(4, i_q), full)
    np.testing.assert_allclose(single[:2], full[:2], rtol=1e-12, atol=1e-12)
    assert not single[2:].any()


@settings(max_examples=60, deadline=None)
@given(gaps, st.floats(-4.0, 4.0), st.floats(-3.0, 3.0))
def test_the_inverse_inverts(gap: float, w_y: float, w_x: float) -> None:
    """By (1), (2) the currents give what was wanted, or what the inverse says they give."""
    direct, quadrature, realised, limited = inverse(gap, w_y, w_x, CurrentLimits(7.0, 1.0, 0.1))
    assert not direct[[0, 2, 3]].any()
    assert not quadrature[[0, 2, 3]].any()
    i_d, i_q = direct[1], quadrature[1]
    got = MACHINE.G + vertical_force(MACHINE, gap, i_d, i_q) / MACHINE.M_y
    across = horizontal_force(MACHINE, gap, i_q) / MACHINE.M_x
    np.testing.assert_allclose(realised[:2], [got, across], rtol=1e-9, atol=1e-9)
    if not limited:
        np.testing.assert_allclose([got, across], [w_y, w_x], rtol=1e-9, atol=1e-8)


@settings(max_examples=60, deadline=None)
@given(gaps, st.floats(-200.0, 9.8), st.floats(-500.0, 500.0))
def test_levitation_comes_before_travel(gap: float, w_y: float, w_x: float) -> None:
    """Within the amplitude; i_q never costs the attraction that the platen needs."""
    limits = CurrentLimits(7.0, 1.0, 0.1)
    direct, quadrature, realised, _ = inverse(gap, w_y, w_x, limits)
    assert math.hypot(direct[1], quadrature[1]) <= 7.0 * (1.0 + 1e-9)
    alone = inverse(gap, w_y, 0.0, limits)[2]
    assert realised[0] == pytest.approx(alone[0], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(
    ('w_y', 'w_x', 'limited_by'),
    [
        (12.0, 0.0, LEVITATION),  # fall faster than with the least attraction
        (-1000.0, 0.0, CURRENT),  # rise faster than the current makes it
        (0.0, 2.0, 0),
        (0.0, 200.0, LEVITATION),  # i_q beyond what the attraction leaves
        (-1000.0, 200.0, CURRENT | LEVITATION),
    ],
)
def test_what_limits_it_is_told(w_y: float, w_x: float, limited_by: int) -> None:
    limits = CurrentLimits(7.0, 1.0, 0.1)
    _, _, realised, told = inverse(0.025, w_y, w_x, limits)
    assert told == limited_by
    assert (realised[0] == pytest.approx(w_y, abs=1e-6)) == (abs(w_y) < 10.0)
    assert (realised[1] == pytest.approx(w_x, abs=1e-6)) == (w_x < 200.0)


@pytest.mark.parametrize('left', [-0.05, 0.05])
def test_an_attraction_that_leaves_too_little_for_i_q_is_told_beside_the_current(
    left: float,
) -> None:
    """By (2) b² i_q² of the attraction wanted are spent; ``left`` [N] are for i_d, which is cut."""
    _, b, _ = attraction_coefficients(MACHINE, 0.0185)
    pull = (2.5 * b) ** 2 + left
    w_y = MACHINE.G - pull / MACHINE.M_y
    direct, quadrature, _, told = inverse(0.0185, w_y, 500.0, CurrentLimits(2.5, 0.0, 0.0))
    assert (direct[1], abs(quadrature[1])) == (2.5, 2.5)
    assert told == (CURRENT if left > 0.0 else CURRENT | LEVITATION)


def test_a_single_motor_needs_its_guides_locked() -> None:
    """What it cannot move must not be free."""
    with pytest.raises(ParameterError, match=r"'guide.locked' leaves z, phi or theta free"):
        build(PlantParameters, {'machine.motors': 1})
    with pytest.raises(ParameterError, match="'motors' is 2, it must be 1 or 4"):
        MachineParameters(motors=2)


@pytest.mark.parametrize('scenario', ['steps', 'sinusoids'])
def test_its_scenario_flies(scenario: str) -> None:
    """From the stop through the shortened scenario: at the encoders' resolution, one motor only."""
    single = PARAMS / 'single_motor.yaml'
    reference = from_yaml(
        ReferenceParameters, 'reference', single, PARAMS / f'scenario_single_motor_{scenario}.yaml'
    )
    short = {'duration': 1.0 if scenario == 'steps' else 4.0, 'steps.settle': 1.0}
    timeline = Timeline(replace(reference, short))
    assert timeline.end is not None
    block = timeline.block(0, timeline.end)
    stage = SimulatedStage(from_yaml(PlantParameters, 'plant', PARAMS / 'benchmark.yaml', single))
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', single))
    assert stage.parameters.machine == regulator.parameters.machine == reference.machine
    outcome = run(regulator, stage, References(block.position, block.velocity, block.acceleration))
    assert not outcome.direct_current[:, [0, 2, 3]].any()
    error = 1e6 * np.abs(outcome.output - block.position)
    assert not error[:, 2:].any()
    if scenario == 'sinusoids':
        tracked = block.phase == Phase.TRACK
        assert np.all(error[tracked, :2].mean(axis=0) < 4.0)
        return
    for segment in np.unique(block.segment[block.phase == Phase.STEP]):
        assert np.all(error[block.segment == segment, :2][-500:].max(axis=0) < 10.0)
