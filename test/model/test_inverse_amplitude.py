"""The exact inverse where the whole phase amplitude is needed: i_q gets what i_d leaves."""

from __future__ import annotations

import numpy as np
import pytest
from answered import PRIORITY, WIDE, Answered

from maglev_model.inverse import CURRENT, LEVITATION, exact_inverse


@pytest.mark.parametrize('gap', [0.02, 0.025, 0.03])
@pytest.mark.parametrize(('axis', 'motors'), [(1, [1, 3]), (2, [0, 2])])
def test_lifted_hard_the_whole_amplitude_serves_both(
    gap: float, axis: int, motors: list[int]
) -> None:
    """i_q gets what i_d leaves of 7 A, which is told beside; below that only what it attracts."""
    output, wanted = np.array([gap, 0.0, 0.0, 0.0, 0.0]), np.zeros(5)
    for lift, limited_by in ((-60.0, LEVITATION), (-100.0, LEVITATION | CURRENT)):
        wanted[0], wanted[axis] = lift, 100.0
        answer = Answered(exact_inverse, PRIORITY, output, wanted)
        assert answer.limited_by == limited_by
        assert answer.plant[0] == pytest.approx(lift, rel=1e-9)
        amplitude = np.hypot(answer.direct, answer.quadrature)[motors]
        assert (amplitude == pytest.approx(7.0, rel=1e-9)) is (lift == -100.0)
    wanted[0] = -500.0
    answer = Answered(exact_inverse, PRIORITY, output, wanted)
    assert answer.direct.tolist() == [-7.0] * 4
    assert not answer.quadrature.any()


def test_nothing_is_limited_where_an_amplitude_just_serves() -> None:
    """At the limit to the last bit, which is told only where something is cut."""
    hover, wanted = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.zeros(5)
    needed = Answered(exact_inverse, WIDE, hover, wanted).direct[0]
    just = PRIORITY._replace(current=abs(needed))
    assert Answered(exact_inverse, just, hover, wanted).limited_by == 0
