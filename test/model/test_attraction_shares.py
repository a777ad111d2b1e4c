"""How the attraction is shared among the motors, and what it leaves of i_q."""

from __future__ import annotations

import numpy as np
import pytest
from answered import MACHINE, PRIORITY, WIDE, Answered, outputs
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.inverse import CURRENT, LEVITATION, CurrentLimits, exact_inverse
from maglev_model.motor import attraction_coefficients
from maglev_model.platen import gaps_from_outputs


def attractions(answer: Answered, output: np.ndarray) -> np.ndarray:
    """What each motor pulls with by (2), (4,) [N]."""
    gap = np.empty(4)
    gaps_from_outputs(MACHINE, output, gap)
    a, b, _ = np.transpose([attraction_coefficients(MACHINE, each) for each in gap])
    pulls: np.ndarray = (a - b * answer.direct) ** 2 + (b * answer.quadrature) ** 2
    return pulls


@settings(max_examples=100)
@given(
    output=outputs,
    lift=st.floats(-8.0, 60.0),
    along_z=st.floats(0.2, 0.8),
    ways=st.tuples(st.sampled_from([-1e3, 1e3]), st.sampled_from([-1e3, 1e3])),
    limit=st.sampled_from([1.0, 1.4, 7.0]),
)
def test_levitation_leaves_the_largest_i_q_that_some_i_d_goes_with(
    output: np.ndarray, lift: float, along_z: float, ways: tuple[float, float], limit: float
) -> None:
    """Of both motors of a pair, found by trying 7,000 of them: (2) within the amplitude."""
    wanted = np.array([-lift, *ways, 0.0, 0.0])
    limits = PRIORITY._replace(along_z=along_z, current=limit)
    answer = Answered(exact_inverse, limits, output, wanted)
    gap, i_q, most = np.empty(4), np.linspace(0.0, 7.0, 7_001), np.empty(4)
    gaps_from_outputs(MACHINE, output, gap)
    for motor, pull in enumerate(attractions(answer, output)):
        a, b, _ = attraction_coefficients(MACHINE, gap[motor])
        left = pull - (b * i_q) ** 2
        fits = np.hypot((a - np.sqrt(np.maximum(left, 0.0))) / b, i_q) <= limit
        most[motor] = i_q[fits & (left >= 0.0)].max(initial=0.0)
    largest = np.tile([min(most[0], most[2]), min(most[1], most[3])], 2)
    np.testing.assert_allclose(np.abs(answer.quadrature), largest, atol=2e-3)
    assert answer.limited_by & LEVITATION


@pytest.mark.parametrize('gap', [0.019, 0.025, 0.03])
def test_all_of_the_attraction_may_be_that_of_i_q(gap: float) -> None:
    """P = b² i_q², where the amplitude is no matter."""
    output, wanted = np.array([gap, 0.0, 0.0, 0.0, 0.0]), np.array([0.0, 1e3, 1e3, 0.0, 0.0])
    answer = Answered(exact_inverse, PRIORITY._replace(current=1e3), output, wanted)
    b = attraction_coefficients(MACHINE, gap)[1]
    pull = attractions(answer, output)
    np.testing.assert_allclose((b * answer.quadrature) ** 2, pull, rtol=1e-9)
    assert pull.sum() == pytest.approx(MACHINE.M_y * MACHINE.G)


def test_where_levitation_needs_all_the_current_none_is_left_for_a_push() -> None:
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([-1e3, 2.0, 2.0, 0.0, 0.0])
    answer = Answered(exact_inverse, PRIORITY, output, wanted)
    np.testing.assert_array_equal(answer.quadrature, 0.0)
    assert np.abs(answer.direct) == pytest.approx(7.0)
    assert answer.limited_by == LEVITATION | CURRENT


@settings(max_examples=300)
@given(
    output=outputs,
    lift=st.floats(-8.7, 20.0),
    pushes=st.tuples(st.floats(-15.0, 15.0), st.floats(-15.0, 15.0)),
    tilts=st.tuples(st.floats(-60.0, 60.0), st.floats(-60.0, 60.0)),
    along_z=st.floats(0.1, 0.9),
    least=st.sampled_from([0.0, 0.1, 0.4]),
)
def test_a_pair_gets_what_its_motors_need_and_else_its_share(
    output: np.ndarray,
    lift: float,
    pushes: tuple[float, float],
    tilts: tuple[float, float],
    along_z: float,
    least: float,
) -> None:
    """Each motor a tenth more than its i_q pulls with, and a quarter of the least attraction.

    Where that is more than there is, the pairs divide it as they need it.
    """
    limits = CurrentLimits(1e3, 1.0, least, along_z, tilt=1.0)
    wanted = np.array([-lift, *pushes, *tilts])
    pull = attractions(Answered(exact_inverse, limits, output, wanted), output)
    weight = MACHINE.M_y * MACHINE.G
    total = max(MACHINE.M_y * (MACHINE.G + lift), least * weight)
    np.testing.assert_allclose(pull.sum(), total, rtol=1e-9)
    gap = np.empty(4)
    gaps_from_outputs(MACHINE, output, gap)
    b = np.array([attraction_coefficients(MACHINE, each)[1] for each in gap])
    i_q = Answered(exact_inverse, WIDE, output, wanted).quadrature
    floor = np.maximum(1.1 * (b * i_q) ** 2, 0.25 * least * weight)
    stiff = np.array([MACHINE.k_s_phi, MACHINE.k_s_theta]) * output[3:]
    more = (np.array(tilts) + stiff) * MACHINE.I_x / MACHINE.r  # P1 - P3, P4 - P2
    more = np.clip(more, -total, total)
    z = max(2.0 * floor[0] - more[0], 2.0 * floor[2] + more[0])
    x = max(2.0 * floor[3] - more[1], 2.0 * floor[1] + more[1])
    within = min(max(along_z * total, z), total - x)
    expected = within if x + z <= total else total * z / (x + z)
    assert pull[0] + pull[2] == pytest.approx(expected, rel=1e-6, abs=1e-6)
    held = np.clip(more, [-expected, expected - total], [expected, total - expected])
    assert pull[0] - pull[2] == pytest.approx(held[0], rel=1e-6, abs=1e-5)
    assert pull[3] - pull[1] == pytest.approx(held[1], rel=1e-6, abs=1e-5)


@pytest.mark.parametrize('share', [0.0, 0.1, 0.3])
def test_the_least_attraction_stays(share: float) -> None:
    output, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([30.0, 0.0, 0.0, 0.0, 0.0])
    answer = Answered(exact_inverse, PRIORITY._replace(least_attraction=share), output, wanted)
    assert answer.plant[0] == pytest.approx((1.0 - share) * MACHINE.G)
