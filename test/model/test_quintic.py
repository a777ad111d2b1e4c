"""Quintic transitions against polynomials fitted by NumPy, and their bounds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.quintic import (
    PEAK_ACCELERATION,
    PEAK_VELOCITY,
    braking_times,
    coasted,
    evaluate_quintic,
    minimum_jerk,
    minimum_jerk_time,
    quintic_coefficients,
    quintic_to_zero,
    time_to_zero,
    transition_time,
)

VALUES = st.floats(-1.0, 1.0)
TIMES = st.floats(0.05, 3.0)


def fitted(start: np.ndarray, end: np.ndarray, duration: float) -> np.poly1d:
    """The quintic with position, velocity, acceleration (3,) at both ends, by a linear solve."""
    rows = []
    for time in (0.0, duration):
        for order in range(3):
            powers = [np.poly1d(np.eye(6)[k]).deriv(order)(time) for k in range(6)]
            rows.append(powers)
    return np.poly1d(np.linalg.solve(np.array(rows, dtype=float), np.concatenate([start, end])))


@given(st.tuples(VALUES, VALUES, VALUES), st.tuples(VALUES, VALUES, VALUES), TIMES)
def test_quintic_joins_two_states(
    start: tuple[float, ...], end: tuple[float, ...], duration: float
) -> None:
    states = [tuple(np.array([value]) for value in state) for state in (start, end)]
    time = np.linspace(0.0, duration, 7)
    found = evaluate_quintic(quintic_coefficients(*states, duration), duration, time)
    wanted = fitted(np.array(start), np.array(end), duration)
    scale = max(1.0, duration**-2)
    for order, values in enumerate(found):
        assert values[:, 0] == pytest.approx(wanted.deriv(order)(time), abs=1e-8 * scale)


@given(VALUES, VALUES, VALUES, TIMES, st.floats(0.0, 1.2))
def test_quintic_to_zero_is_the_same_curve(
    position: float, velocity: float, acceleration: float, duration: float, share: float
) -> None:
    start = tuple(np.array([value]) for value in (position, velocity, acceleration))
    rest = (np.zeros(1),) * 3
    elapsed = share * duration
    found = quintic_to_zero(position, velocity, acceleration, duration, elapsed)
    if elapsed >= duration:
        assert found == (0.0, 0.0, 0.0)
        return
    coefficients = quintic_coefficients(start, rest, duration)
    wanted = evaluate_quintic(coefficients, duration, np.array([elapsed]))
    assert found == pytest.approx([float(value[0, 0]) for value in wanted], rel=1e-12, abs=1e-12)


def test_minimum_jerk_is_the_quintic_between_rests() -> None:
    share = np.linspace(0.0, 1.0, 501)
    zero, one = np.zeros(1), np.ones(1)
    coefficients = quintic_coefficients((zero, zero, zero), (one, zero, zero), 1.0)
    for found, wanted in zip(
        minimum_jerk(share), evaluate_quintic(coefficients, 1.0, share), strict=True
    ):
        assert found == pytest.approx(wanted[:, 0], abs=1e-13)
    peaks = [np.abs(values).max() for values in minimum_jerk(share)[1:]]
    assert pytest.approx(peaks, rel=1e-4) == [PEAK_VELOCITY, PEAK_ACCELERATION]


@given(st.floats(1e-4, 1.0), st.floats(1e-3, 10.0), st.floats(1e-3, 10.0))
def test_the_shortest_time_meets_one_bound(
    distance: float, velocity: float, acceleration: float
) -> None:
    time = minimum_jerk_time(distance, velocity, acceleration)
    shares = (
        PEAK_VELOCITY * distance / time / velocity,
        PEAK_ACCELERATION * distance / time**2 / acceleration,
    )
    assert max(shares) == pytest.approx(1.0)
    assert transition_time(distance, acceleration, 0.0) <= time * (1.0 + 1e-12)


@given(st.floats(0.0, 1.0), st.floats(-2.0, 2.0), st.floats(-20.0, 20.0))
def test_braking_stays_within_the_stops(position: float, velocity: float, push: float) -> None:
    start, speed, bend = np.array([position]), np.array([velocity]), np.array([push])
    longest = 0.4
    times = braking_times(start, speed, np.zeros(1), np.ones(1), longest, bend)
    assert 0.05 <= times[0] <= longest
    end = start + coasted(speed, bend, times)
    if times[0] > 0.05:
        coefficients = quintic_coefficients(
            (start, speed, bend), (end, np.zeros(1), np.zeros(1)), float(times[0])
        )
        assert coefficients[5] == pytest.approx(0.0, abs=1e-12)
        way = evaluate_quintic(coefficients, float(times[0]), np.linspace(0.0, times[0], 50))[0]
        assert way.min() >= -1e-9
        assert way.max() <= 1.0 + 1e-9


@pytest.mark.parametrize('position', [-0.01, 0.0, 1.0, 1.01])
def test_what_rests_at_either_stop_or_beyond_it_takes_its_time(position: float) -> None:
    still = np.zeros(1)
    times = braking_times(np.array([position]), still, np.zeros(1), np.ones(1), 0.4)
    assert times.tolist() == [0.4]


@given(st.floats(-0.06, 0.06), st.floats(-0.6, 0.6), st.floats(-6.0, 6.0), st.floats(1.0, 20.0))
def test_what_moves_already_comes_to_rest_within_the_acceleration(
    position: float, velocity: float, acceleration: float, most: float
) -> None:
    """It takes no longer than it must: 5 % less would be too much of it, or less than the least."""
    duration = time_to_zero(position, velocity, acceleration, most, 0.2)

    def largest(duration: float) -> float:
        times = np.linspace(0.0, duration, 501, endpoint=False)
        way = [quintic_to_zero(position, velocity, acceleration, duration, t) for t in times]
        return float(np.abs(np.array(way)[:, 2]).max())

    bound = max(most, abs(acceleration))
    assert largest(duration) <= bound * (1.0 + 1e-9)
    rest = transition_time(position, most, 0.2)
    assert duration == rest or largest(duration / 1.05) > bound * (1.0 - 1e-3)


def test_from_rest_it_takes_the_time_of_a_transition() -> None:
    for way in (0.0, 0.001, -0.06):
        assert time_to_zero(way, 0.0, 0.0, 4.0, 0.2) == transition_time(way, 4.0, 0.2)
