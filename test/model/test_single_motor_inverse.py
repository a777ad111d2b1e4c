"""The inverse for the single-motor machine of refs. [10], [11], against (1) and (2)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_motor import horizontal_force, vertical_force

from maglev_model.inverse import CURRENT, LEVITATION, Answer, CurrentLimits, exact_inverse
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import output_accelerations

MACHINE = machine_constants(MachineParameters(motors=1, mass_y=1.725, mass_x=5.3))
BOTH = np.array([1.0, 1.0, 0.0, 0.0, 0.0])
PRIORITY = CurrentLimits(7.0, 1.0, 0.1)
PLAIN = CurrentLimits(7.0, 0.0, 0.1)

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


@settings(max_examples=60)
@given(gaps, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_it_is_four_motors_that_carry_four_and_two_times_the_mass(
    gap: float, i_d: float, i_q: float
) -> None:
    """One motor with (1), (2) is all four of (6) with equal currents, per its share of mass."""
    four = machine_constants(MachineParameters(mass_y=4.0 * 1.725, mass_x=2.0 * 5.3))
    only = np.array([0.0, 1.0, 0.0, 0.0])
    single = output_accelerations(MACHINE, gap, 0.0, 0.0, i_d * only, i_q * only)
    full = output_accelerations(four, gap, 0.0, 0.0, np.full(4, i_d), np.full(4, i_q))
    np.testing.assert_allclose(single[:2], full[:2], rtol=1e-12, atol=1e-12)
    assert not any(single[2:])


@settings(max_examples=60)
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


@settings(max_examples=60)
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


def wanted_quadrature(gap: float, w_x: float) -> float:
    """i_q [A] that by (1) makes an acceleration along x."""
    return w_x * MACHINE.M_x / horizontal_force(MACHINE, gap, 1.0)


@settings(max_examples=100)
@given(gaps, st.floats(-150.0, 8.8), st.floats(-500.0, 500.0), st.sampled_from([PRIORITY, PLAIN]))
def test_it_takes_the_most_i_q_that_there_is_room_for(
    gap: float, w_y: float, w_x: float, limits: CurrentLimits
) -> None:
    """Found by trying 7,000 of them; without priority each of i_d and i_q has the whole limit."""
    direct, quadrature, realised, _ = inverse(gap, w_y, w_x, limits)
    a, b, _ = attraction_coefficients(MACHINE, gap)
    pull = MACHINE.M_y * (MACHINE.G - w_y)
    tried = np.linspace(0.0, 7.0, 7_001)
    if limits is PRIORITY:
        left = pull - (b * tried) ** 2
        root = np.sqrt(np.maximum(left, 0.0))
        tried = tried[(left >= 0.0) & (np.hypot((a - root) / b, tried) <= 7.0)]
    u = wanted_quadrature(gap, w_x)
    i_q = np.copysign(min(abs(u), tried.max(initial=0.0)), u)
    assert quadrature[1] == pytest.approx(i_q, abs=1.1e-3)
    i_q = quadrature[1]
    i_d = (a - math.sqrt(max(pull - (b * i_q) ** 2, 0.0))) / b
    most = math.sqrt(max(49.0 - i_q**2, 0.0)) if limits is PRIORITY else 7.0
    assert direct[1] == pytest.approx(min(max(i_d, -most), most), abs=1e-6)
    assert not realised[2:].any()


@pytest.mark.parametrize('gap', [0.02, 0.025, 0.03])
@pytest.mark.parametrize('w_x', [-500.0, 500.0])
def test_lifted_hard_the_whole_amplitude_serves_both(gap: float, w_x: float) -> None:
    """i_q gets what i_d leaves of 7 A; what no current lifts any more leaves it nothing."""
    direct, quadrature, realised, told = inverse(gap, -245.0, w_x, PRIORITY)
    assert math.hypot(direct[1], quadrature[1]) == pytest.approx(7.0, rel=1e-9)
    assert 5.0 < abs(quadrature[1]) < 6.99
    assert direct[1] < -0.5
    assert realised[0] == pytest.approx(-245.0, rel=1e-9)
    assert told == CURRENT | LEVITATION
    direct, quadrature, _, told = inverse(gap, -500.0, w_x, PRIORITY)
    assert (direct[1], quadrature[1]) == (-7.0, 0.0)
    assert told == CURRENT | LEVITATION


@pytest.mark.parametrize('w_x', [-500.0, -2.0, 2.0, 500.0])
def test_it_tells_by_how_much_i_q_was_cut(w_x: float) -> None:
    room = [np.full(n, 9.0) for n in (4, 4, 5, 2)]
    output = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    wanted = np.array([0.0, w_x, 0.0, 0.0, 0.0])
    exact_inverse(MACHINE, PRIORITY, BOTH, output, wanted, Answer(*room))
    u = wanted_quadrature(0.025, w_x)
    np.testing.assert_allclose(room[3], [room[1][1] - u, 0.0], atol=1e-12)
    assert (abs(room[3][0]) > 1.0) == (abs(w_x) > 100.0)


@pytest.mark.parametrize('axis', [0, 1])
def test_what_nobody_controls_is_left_as_it_is(axis: int) -> None:
    """y to the magnets' own attraction, x without i_q; the other has what it wants."""
    controlled, wanted = BOTH.copy(), np.array([-2.0, 3.0, 0.0, 0.0, 0.0])
    controlled[axis] = 0.0
    direct, quadrature, realised, excess = (np.empty(n) for n in (4, 4, 5, 2))
    output = np.array([0.023, 0.0, 0.0, 0.0, 0.0])
    answer = Answer(direct, quadrature, realised, excess)
    assert exact_inverse(MACHINE, PRIORITY, controlled, output, wanted, answer) == 0
    magnets = MACHINE.G + vertical_force(MACHINE, 0.023, 0.0, 0.0) / MACHINE.M_y
    left = (magnets, 0.0)[axis]
    assert realised[axis] == pytest.approx(left, abs=1e-9)
    assert realised[1 - axis] == pytest.approx(wanted[1 - axis], abs=1e-9)


@pytest.mark.parametrize('share', [0.0, 0.1, 0.3])
def test_the_least_attraction_stays(share: float) -> None:
    limits = PRIORITY._replace(least_attraction=share)
    assert inverse(0.025, 30.0, 0.0, limits)[2][0] == pytest.approx((1.0 - share) * MACHINE.G)
