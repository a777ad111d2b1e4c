"""Both inverses against the plant's own equations, and their limits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from answered import ALL, MACHINE, PRIORITY, WIDE, Answered, gentle, outputs, rough
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.inverse import (
    CURRENT,
    LEVITATION,
    NO_LIMITS,
    Answer,
    CurrentLimits,
    exact_inverse,
    simplified_inverse,
)
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import affine_terms, output_accelerations


@settings(max_examples=150)
@given(output=outputs, wanted=gentle)
def test_exact_inverse_inverts_the_full_plant(output: np.ndarray, wanted: np.ndarray) -> None:
    """(6), (7) with the currents of the exact inverse give the wanted accelerations."""
    tilts = np.array([0.0, 0.0, 0.0, MACHINE.k_s_phi * output[3], MACHINE.k_s_theta * output[4]])
    answer = Answered(exact_inverse, PRIORITY, output, wanted - tilts)
    np.testing.assert_allclose(answer.plant, wanted - tilts, rtol=1e-9, atol=1e-9)
    assert answer.limited_by == 0
    np.testing.assert_allclose(answer.quadrature[[0, 1]], answer.quadrature[[2, 3]])


@settings(max_examples=100)
@given(output=outputs, wanted=gentle)
def test_simplified_inverse_solves_equation_11(output: np.ndarray, wanted: np.ndarray) -> None:
    """The paper's nominal model, from its a_i, b_j, c_k, gives the wanted accelerations."""
    answer = Answered(simplified_inverse, WIDE, output, wanted)
    a, b, c = np.zeros(9), np.zeros(6), np.zeros(6)
    u_x, u_z = answer.quadrature[1], answer.quadrature[0]
    affine_terms(MACHINE, output[0], output[3], output[4], u_x, u_z, a, b, c)
    v_phi, v_theta = answer.direct[0] - answer.direct[2], answer.direct[3] - answer.direct[1]
    v_y = answer.direct[0] + answer.direct[2]
    assert v_y == pytest.approx(answer.direct[1] + answer.direct[3], abs=1e-9)  # (8)
    assert a[0] + a[2] * v_y + a[1] * v_phi + a[6] * v_theta == pytest.approx(wanted[0], abs=1e-8)
    assert b[0] + b[2] * v_y + b[1] * v_phi == pytest.approx(wanted[3], abs=1e-8)
    assert c[0] + c[2] * v_y + c[1] * v_theta == pytest.approx(wanted[4], abs=1e-8)
    np.testing.assert_allclose(answer.plant[1:3], wanted[1:3], rtol=1e-9, atol=1e-12)


def test_the_paper_leaves_a_fifth_of_the_vertical_force_out_at_20_mm() -> None:
    """Off the balance the simplified inverse misses (6) by the quadratic terms of (9)."""
    output, wanted = np.array([0.020, 0.0, 0.0, 0.0, 0.0]), np.zeros(5)
    simplified = Answered(simplified_inverse, WIDE, output, wanted)
    exact = Answered(exact_inverse, WIDE, output, wanted)
    assert abs(exact.plant[0]) < 1e-12
    v_y = 2.0 * simplified.direct[0]
    a, b, c = np.zeros(9), np.zeros(6), np.zeros(6)
    affine_terms(MACHINE, 0.020, 0.0, 0.0, 0.0, 0.0, a, b, c)
    assert simplified.plant[0] == pytest.approx(a[5] * v_y**2, rel=1e-9)
    assert 0.15 < -a[5] * v_y**2 / (a[2] * v_y) < 0.25


@settings(max_examples=200)
@given(
    output=outputs,
    wanted=rough,
    tilt=st.sampled_from([0.3, 0.5, 0.9]),
    controlled=st.tuples(*[st.just(1.0)] * 3, *[st.sampled_from([0.0, 1.0])] * 2).map(np.array),
)
def test_limits_hold_whatever_is_wanted(
    output: np.ndarray, wanted: np.ndarray, tilt: float, controlled: np.ndarray
) -> None:
    """Phase amplitude within 7 A, and what is said to be realised is what the plant then does."""
    answer = Answered(exact_inverse, PRIORITY._replace(tilt=tilt), output, wanted, controlled)
    amplitude = np.hypot(answer.direct, answer.quadrature)
    assert np.all(amplitude <= PRIORITY.current * (1.0 + 1e-9))
    np.testing.assert_allclose(answer.plant, answer.realised, rtol=1e-9, atol=1e-9)
    ruled = controlled != 0.0
    met = np.allclose(answer.plant[ruled], wanted[ruled], rtol=1e-6, atol=1e-6)
    assert met or answer.limited_by != 0
    asked = Answered(exact_inverse, WIDE._replace(current=np.inf), output, wanted).quadrature
    np.testing.assert_allclose(answer.excess, (answer.quadrature - asked)[[1, 0]], atol=1e-9)
    at_limit = bool(np.any(amplitude >= PRIORITY.current * (1.0 - 1e-9)))
    assert bool(answer.limited_by & CURRENT) == (at_limit and answer.limited_by != 0)


@settings(max_examples=100)
@given(output=outputs, horizontal=st.tuples(st.floats(-300, 300), st.floats(-300, 300)))
def test_levitation_comes_first(output: np.ndarray, horizontal: tuple[float, float]) -> None:
    """However much u_x and u_z are asked for, y and the tilts get what they want."""
    tilts = -np.array([MACHINE.k_s_phi * output[3], MACHINE.k_s_theta * output[4]])
    wanted = np.array([0.5, *horizontal, *tilts])
    answer = Answered(exact_inverse, PRIORITY, output, wanted)
    np.testing.assert_allclose(answer.plant[[0, 3, 4]], wanted[[0, 3, 4]], rtol=1e-6, atol=1e-6)
    for axis in (1, 2):  # in the wanted direction, never more than wanted
        assert answer.plant[axis] * wanted[axis] >= 0.0
        assert abs(answer.plant[axis]) <= abs(wanted[axis]) * (1.0 + 1e-9)


@settings(max_examples=100)
@given(
    output=outputs,
    wanted=rough,
    pushes=st.tuples(st.floats(0, 300), st.floats(0, 300)),
    ways=st.sampled_from([(1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]),
)
def test_a_push_the_other_way_turns_the_quadrature_current_alone(
    output: np.ndarray, wanted: np.ndarray, pushes: tuple[float, float], ways: tuple[float, float]
) -> None:
    """By (1), (2): the attraction knows i_q by its square, beyond what is possible too."""
    there, other = wanted.copy(), wanted.copy()
    there[1:3], other[1:3] = pushes, np.multiply(ways, pushes)
    one, two = (Answered(exact_inverse, PRIORITY, output, each) for each in (there, other))
    turned = np.array([ways[1], ways[0], ways[1], ways[0]])
    np.testing.assert_allclose(two.direct, one.direct, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(two.quadrature, turned * one.quadrature, rtol=1e-12, atol=1e-12)
    assert one.limited_by == two.limited_by


def test_without_priority_a_large_quadrature_current_costs_levitation() -> None:
    """Why there is one: i_q attracts, and at 7 A nothing is left to lower the attraction."""
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 100.0, 0.0, 0.0, 0.0])
    plain = Answered(exact_inverse, PRIORITY._replace(levitation_first=0.0), output, wanted)
    assert abs(plain.quadrature[1]) == 7.0
    assert plain.plant[0] < -50.0
    assert abs(Answered(exact_inverse, PRIORITY, output, wanted).plant[0]) < 1e-9


def test_horizontal_acceleration_at_hover_is_enough_for_the_steps() -> None:
    """At least 6 m/s² anywhere in 20-30 mm; an even split of the attraction would give 5."""
    for gap in (0.020, 0.025, 0.030):
        output = np.array([gap, 0.0, 0.0, 0.0, 0.0])
        answer = Answered(exact_inverse, PRIORITY, output, np.array([0.0, 100.0, 0.0, 0.0, 0.0]))
        assert answer.plant[1] > 6.0


@pytest.mark.parametrize('inverse', [exact_inverse, simplified_inverse])
def test_tilts_without_control_get_equal_direct_currents(inverse: Callable[..., int]) -> None:
    """v_φ = v_θ = 0, and the vertical axis still has what it wants with the exact inverse."""
    controlled = np.array([1.0, 1.0, 1.0, 0.0, 0.0])
    output = np.array([0.024, 0.0, 0.0, 0.001, -0.002])
    wanted = np.array([1.0, 0.3, -0.2, 55.0, -70.0])
    answer = Answered(inverse, WIDE, output, wanted, controlled)
    assert answer.direct[0] == pytest.approx(answer.direct[2], abs=1e-12)
    assert answer.direct[1] == pytest.approx(answer.direct[3], abs=1e-12)
    if inverse is exact_inverse:
        np.testing.assert_allclose(answer.plant[:3], wanted[:3], rtol=1e-9)
        balance = np.array([0.0287, 0.0, 0.0, 0.0, 0.0])
        assert np.abs(Answered(inverse, WIDE, balance, np.zeros(5), controlled).direct).max() < 0.1


@pytest.mark.parametrize('inverse', [exact_inverse, simplified_inverse])
def test_horizontal_axes_without_control_get_no_current(inverse: Callable[..., int]) -> None:
    """And y without control gets no direct current."""
    controlled = np.array([0.0, 0.0, 0.0, 1.0, 1.0])
    output = np.array([0.025, 0.01, 0.0, 0.0, 0.0])
    answer = Answered(inverse, WIDE, output, np.array([3.0, 2.0, 1.0, 0.0, 0.0]), controlled)
    assert not answer.quadrature.any()
    np.testing.assert_allclose(answer.direct, 0.0, atol=1e-12)


def test_simplified_saturation_is_sat_7() -> None:
    """u_x clipped at 7 A, the excess of (17) told, the other currents by themselves."""
    limits = CurrentLimits(current=7.0, levitation_first=0.0, least_attraction=0.0)
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 90.0, 1.0, 0.0, 0.0])
    answer = Answered(simplified_inverse, limits, output, wanted)
    free = Answered(simplified_inverse, WIDE, output, wanted)
    assert answer.quadrature[1] == -7.0
    assert answer.excess[0] == pytest.approx(-7.0 - free.quadrature[1])
    assert answer.excess[1] == 0.0
    assert answer.limited_by == CURRENT
    assert free.limited_by == 0


@pytest.mark.parametrize(
    ('axis', 'wanted', 'limited_by'),
    [
        (0, 12.0, LEVITATION),  # fall faster than with the least attraction
        (0, -1000.0, CURRENT),  # rise faster than the currents make it
        (3, 500.0, LEVITATION),  # tilt with more than half of the attraction
        (1, 2.0, 0),
    ],
)
def test_what_limits_is_told(axis: int, wanted: float, limited_by: int) -> None:
    w = np.zeros(5)
    w[axis] = wanted
    answer = Answered(exact_inverse, PRIORITY, np.array([0.025, 0.0, 0.0, 0.0, 0.0]), w)
    assert answer.limited_by == limited_by


@pytest.mark.parametrize('axis', [3, 4])
@pytest.mark.parametrize('way', [-1.0, 1.0])
@pytest.mark.parametrize('tilt', [0.3, None, 0.75, 0.9])
def test_a_tilt_gets_its_share_of_the_attraction_and_no_more(
    axis: int, way: float, tilt: float | None
) -> None:
    """By default half, which an even split of the attraction serves."""
    hover = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    limits = PRIORITY if tilt is None else PRIORITY._replace(tilt=tilt)
    most = (tilt or 0.5) * MACHINE.M_y * MACHINE.G * MACHINE.r / MACHINE.I_x
    for wanted in (0.99 * most, 1.2 * most):
        w = np.zeros(5)
        w[axis] = way * wanted
        answer = Answered(exact_inverse, limits, hover, w)
        assert answer.limited_by == (0 if wanted < most else LEVITATION)
        assert answer.plant[axis] == pytest.approx(way * min(wanted, most))
        assert answer.plant[0] == pytest.approx(0.0, abs=1e-9)


def test_quadrature_current_yields_to_levitation_and_is_cut_by_the_current_without() -> None:
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 100.0, 0.0, 0.0, 0.0])
    assert Answered(exact_inverse, PRIORITY, output, wanted).limited_by & LEVITATION
    plain = Answered(exact_inverse, PRIORITY._replace(levitation_first=0.0), output, wanted)
    assert plain.limited_by & CURRENT
    wide = CurrentLimits(current=1000.0, levitation_first=1.0, least_attraction=0.1)
    assert Answered(exact_inverse, wide, output, wanted).limited_by == LEVITATION


@pytest.mark.parametrize('current', [1000.0, 0.4])
def test_what_the_simplified_inverse_realises_is_what_its_own_model_gives(current: float) -> None:
    """Tilted and, at 0.4 A, cut: (11) with the currents as they are, which is no longer wanted."""
    output, wanted = (
        np.array([0.023, 0.0, 0.0, 0.002, -0.005]),
        np.array([2.0, 4.0, -3.0, 9.0, 7.0]),
    )
    limits = WIDE._replace(current=current)
    answer = Answered(simplified_inverse, limits, output, wanted)
    a, b, c = np.zeros(9), np.zeros(6), np.zeros(6)
    u_x, u_z = answer.quadrature[1], answer.quadrature[0]
    affine_terms(MACHINE, output[0], output[3], output[4], u_x, u_z, a, b, c)
    i_1, i_2, i_3, i_4 = answer.direct
    v_y, v_phi, v_theta = 0.5 * (i_1 + i_2 + i_3 + i_4), i_1 - i_3, i_4 - i_2
    own = (
        a[0] + a[2] * v_y + a[1] * v_phi + a[6] * v_theta,
        *answer.plant[1:3],
        b[0] + b[2] * v_y + b[1] * v_phi,
        c[0] + c[2] * v_y + c[1] * v_theta,
    )
    assert answer.realised == pytest.approx(own, rel=1e-9)
    assert (answer.realised == pytest.approx(wanted, rel=1e-6)) == (answer.limited_by == 0)
    assert bool(answer.limited_by) == (current < 1000.0)


@pytest.mark.parametrize('only', [3, 4])
def test_a_tilt_alone_is_controlled_by_its_own_motors(only: int) -> None:
    """By (12) , the other row and column left out: it gets no control, y what it wants."""
    controlled = np.ones(5)
    controlled[7 - only] = 0.0
    output, wanted = (
        np.array([0.024, 0.0, 0.0, 0.001, -0.002]),
        np.array([1.0, 0.3, -0.2, 5.0, -7.0]),
    )
    for inverse in (simplified_inverse, exact_inverse):
        answer = Answered(inverse, WIDE, output, wanted, controlled)
        assert answer.realised[[0, only]] == pytest.approx(wanted[[0, only]], rel=1e-6)
        others = answer.direct[[1, 3]] if only == 3 else answer.direct[[0, 2]]
        assert others[0] == pytest.approx(others[1], abs=1e-12)


def test_tilted_y_without_control_is_left_to_the_magnets() -> None:
    """All motors together attract as without current, though each gap is another."""
    controlled = np.array([0.0, 1.0, 1.0, 1.0, 1.0])
    output = np.array([0.025, 0.0, 0.0, 0.003, -0.01])
    wanted = np.zeros(5)
    answer = Answered(exact_inverse, WIDE, output, wanted, controlled)
    none = np.zeros(4)
    alone = output_accelerations(MACHINE, *output[[0, 3, 4]], none, none)
    assert answer.plant[0] == pytest.approx(alone[0], rel=1e-9)
    assert answer.plant[3:] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_no_attraction_at_all_is_possible() -> None:
    """Free fall, where no least attraction is kept: the currents make up for the magnets."""
    wanted = np.array([MACHINE.G, 0.0, 0.0, 0.0, 0.0])
    answer = Answered(exact_inverse, WIDE, np.array([0.025, 0.0, 0.0, 0.0, 0.0]), wanted)
    assert answer.limited_by == 0
    assert answer.plant == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize('tilts', [0.0, 1.0])
@pytest.mark.parametrize('left', [-1e-3, 1e-3])
def test_an_i_q_that_attracts_more_than_its_pair_may_is_told(left: float, tilts: float) -> None:
    """By (2) that is 2 b² i_q²; of half of the weight it leaves so many N, or takes more."""
    _, b, h = attraction_coefficients(MACHINE, 0.025)
    i_q = np.sqrt((0.5 * MACHINE.M_y * MACHINE.G - left) / (2.0 * b * b))
    hover, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.zeros(5)
    wanted[1] = 2.0 * h / MACHINE.M_x * i_q
    controlled = np.array([1.0, 1.0, 1.0, tilts, tilts])
    answer = Answered(exact_inverse, WIDE, hover, wanted, controlled)
    assert abs(answer.quadrature[1]) == pytest.approx(i_q)
    assert answer.limited_by == (0 if left > 0.0 else LEVITATION)
    assert answer.plant[0] == pytest.approx(min(left, 0.0) / MACHINE.M_y, abs=1e-9)


@pytest.mark.parametrize(
    ('inverse', 'motors'), [(exact_inverse, 1), (exact_inverse, 4), (simplified_inverse, 4)]
)
def test_an_inverse_writes_its_answer_and_nothing_beside_it(
    inverse: Callable[..., int], motors: int
) -> None:
    """What lies behind in memory belongs to the rest of a record."""
    machine = machine_constants(MachineParameters(motors=motors))
    output, wanted = np.array([0.025, 0.0, 0.0, 0.001, 0.002]), np.ones(5)
    room = [np.full(size + 2, np.nan) for size in (4, 4, 5, 2)]
    inverse(machine, PRIORITY, ALL, output, wanted, Answer(*(part[1:-1] for part in room)))
    for part in room:
        assert np.isnan(part[[0, -1]]).all()
        assert np.isfinite(part[1:-1]).all()


@settings(max_examples=50)
@given(output=outputs, wanted=gentle, scale=st.floats(1.0, 200.0))
def test_without_limits_all_is_reached_that_attraction_can_give(
    output: np.ndarray, wanted: np.ndarray, scale: float
) -> None:
    """Down to free fall, and up as hard as one likes."""
    lifted = wanted * [1.0, scale, scale, 1.0, 1.0] - [40.0 * scale * scale, 0.0, 0.0, 0.0, 0.0]
    answer = Answered(exact_inverse, NO_LIMITS, output, lifted)
    assert answer.limited_by == 0
    np.testing.assert_allclose(answer.plant, lifted, rtol=1e-6, atol=1e-5)
    falling = np.array([MACHINE.G, 0.0, 0.0, 0.0, 0.0]) - [1e-3, 0.0, 0.0, 0.0, 0.0]
    assert Answered(exact_inverse, NO_LIMITS, np.array([0.025, 0, 0, 0, 0]), falling).plant[
        0
    ] == pytest.approx(falling[0], abs=1e-9)


@settings(max_examples=60)
@given(output=outputs, wanted=gentle, free=st.sets(st.integers(0, 4)))
@pytest.mark.parametrize('inverse', [exact_inverse, simplified_inverse])
def test_each_axis_is_left_alone_by_itself(
    inverse: Callable[..., int], output: np.ndarray, wanted: np.ndarray, free: set[int]
) -> None:
    """Those that are controlled have what they want; a free one has none of its current."""
    controlled = ALL.copy()
    controlled[list(free)] = 0.0
    answer = Answered(inverse, WIDE._replace(tilt=1.0), output, wanted, controlled)
    if answer.limited_by:
        return
    told = answer.realised
    kept = [axis for axis in range(5) if axis not in free]
    np.testing.assert_allclose(told[kept], wanted[kept], rtol=1e-8, atol=1e-8)
    direct, quadrature = answer.direct, answer.quadrature
    for axis, motors in ((1, [1, 3]), (2, [0, 2])):
        assert axis not in free or not quadrature[motors].any()
    for axis, (one, two) in ((3, (0, 2)), (4, (3, 1))):
        assert axis not in free or direct[one] == pytest.approx(direct[two], abs=1e-9)
    if inverse is simplified_inverse and 0 in free:
        assert direct.sum() == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=60)
@given(output=outputs, wanted=rough, current=st.sampled_from([0.5, 7.0]))
def test_the_papers_saturation_cuts_each_current_by_itself(
    output: np.ndarray, wanted: np.ndarray, current: float
) -> None:
    limits = WIDE._replace(current=current)
    answer = Answered(simplified_inverse, limits, output, wanted)
    asked = Answered(simplified_inverse, WIDE._replace(current=np.inf), output, wanted)
    cut = np.clip(asked.quadrature, -current, current)
    np.testing.assert_allclose(answer.quadrature, cut, rtol=1e-12)
    assert np.all(np.abs(answer.direct) <= current)
    np.testing.assert_allclose(answer.excess, (cut - asked.quadrature)[[1, 0]], atol=1e-9)


@pytest.mark.parametrize('tilts', [0.0, 1.0])
def test_without_priority_each_component_has_the_whole_limit(tilts: float) -> None:
    """i_q at its limit leaves i_d its own, as the paper's saturation has it."""
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([-1e3, 1e3, 1e3, 0.0, 0.0])
    controlled = np.array([1.0, 1.0, 1.0, tilts, tilts])
    limits = PRIORITY._replace(levitation_first=0.0)
    answer = Answered(exact_inverse, limits, output, wanted, controlled)
    assert np.abs(answer.quadrature) == pytest.approx(7.0)
    assert np.abs(answer.direct) == pytest.approx(7.0)
