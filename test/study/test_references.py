"""References for the library: they begin and end where they shall, and are their own integrals."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_study.references import HOVER, References, ellipse, ellipse_at, held, joined, shaped

PERIOD = 1e-3
GOAL = np.array([0.022, 0.03, -0.03, 0.001, 0.01])


def assert_consistent(references: References) -> None:
    """Velocity and acceleration are the position's derivatives."""
    for values, rates, bound in (
        (references.position, references.velocity, 2e-5),
        (references.velocity, references.acceleration, 5e-3),
    ):
        slope = (values[2:] - values[:-2]) / (2.0 * PERIOD)
        assert np.abs(slope - rates[1:-1]).max() < bound


@pytest.mark.parametrize('theta', [0.0, 0.010])
@pytest.mark.parametrize('grow', [0.0, 2.0])
def test_the_ellipse_is_the_papers(theta: float, grow: float) -> None:
    references = ellipse(6.0, theta, PERIOD, grow=grow)
    assert_consistent(references)
    whole = references.position[2000:]
    size = 0.5 * (whole.max(axis=0) - whole.min(axis=0))
    assert size == pytest.approx([0.005, 0.03, 0.03, 0.0, theta], abs=1e-7)
    assert whole == pytest.approx(ellipse(6.0, theta, PERIOD).position[2000:], abs=1e-14)
    start = HOVER if grow else HOVER - [0.005, 0.03, 0.0, 0.0, 0.0]
    assert references.position[0] == pytest.approx(start, abs=1e-16)
    assert (not references.velocity[0].any()) == bool(grow)


def test_one_angle_gives_one_instant() -> None:
    instant = ellipse_at(0.3, 0.010)
    row = ellipse_at(np.array([[0.3]]), 0.010)
    for value, values in zip(instant, row, strict=True):
        assert value.shape == (5,)
        np.testing.assert_array_equal(value, values[0])


def test_a_move_ends_at_rest_where_it_shall() -> None:
    move = shaped(HOVER, GOAL, 0.5, 0.3, PERIOD)
    assert_consistent(move)
    parts = joined(held(HOVER, 0.1, PERIOD), move)
    assert [len(values) for values in parts] == [900] * 3
    np.testing.assert_array_equal(parts.position[:101], np.tile(HOVER, (101, 1)))
    np.testing.assert_allclose(parts.position[600:], np.tile(GOAL, (300, 1)), rtol=1e-15)
    assert not parts.velocity[600:].any()
    assert not parts.acceleration[600:].any()
