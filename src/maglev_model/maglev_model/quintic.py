"""Quintic transitions: between any two states smoothly; from rest to rest, minimum jerk."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing, compiled

PEAK_VELOCITY = 15.0 / 8.0
"""Peak speed of a minimum-jerk transition between rests, in distance / duration."""

PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
"""Its peak acceleration, in distance / duration²."""

_LONGER = 1.05  # from one tried duration to the next
_TRIALS = 100


def _highest_coefficients(distance: Any, v_0: Any, v_1: Any, a_0: Any, a_1: Any) -> Any:
    """c_3, c_4, c_5 of the quintic over s = t / T; velocities times T, accelerations times T²."""
    return (
        10.0 * distance - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1,
        -15.0 * distance + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1,
        6.0 * distance - 3.0 * (v_0 + v_1) - 0.5 * (a_0 - a_1),
    )


def _evaluate(c_0: Any, c_1: Any, c_2: Any, c_3: Any, c_4: Any, c_5: Any, s: Any) -> Any:
    """The polynomial and its first two derivatives by s."""
    return (
        c_0 + s * (c_1 + s * (c_2 + s * (c_3 + s * (c_4 + s * c_5)))),
        c_1 + s * (2.0 * c_2 + s * (3.0 * c_3 + s * (4.0 * c_4 + s * 5.0 * c_5))),
        2.0 * c_2 + s * (6.0 * c_3 + s * (12.0 * c_4 + s * 20.0 * c_5)),
    )


_compiled_coefficients = compiled(_highest_coefficients)
_compiled_evaluate = compiled(_evaluate)


@borrowing
def quintic_to_zero(
    position: float, velocity: float, acceleration: float, duration: float, elapsed: float
) -> tuple[float, float, float]:
    """Position, velocity, acceleration at ``elapsed`` [s] of the quintic that ends at rest in zero.

    It starts at 0 s with the given values and reaches zero, with zero velocity and acceleration, at
    ``duration`` [s]. Zero from then on.
    """
    if elapsed >= duration:
        return 0.0, 0.0, 0.0
    slope, bend = velocity * duration, acceleration * duration * duration
    c_3, c_4, c_5 = _compiled_coefficients(-position, slope, 0.0, bend, 0.0)
    value, first, second = _compiled_evaluate(
        position, slope, 0.5 * bend, c_3, c_4, c_5, elapsed / duration
    )
    return value, first / duration, second / (duration * duration)


def quintic_coefficients(
    start: tuple[FloatArray, FloatArray, FloatArray],
    end: tuple[FloatArray, FloatArray, FloatArray],
    duration: float | FloatArray,
) -> FloatArray:
    """c_0 to c_5, shape (6, n), of the quintics from one state to another in ``duration`` [s].

    A state is position, velocity and acceleration, shape (n,) each. Where they are (m, n), and
    ``duration`` (m, 1), those of m transitions, shape (6, m, n).
    """
    v_0, v_1 = start[1] * duration, end[1] * duration
    a_0, a_1 = start[2] * duration**2, end[2] * duration**2
    highest = _highest_coefficients(end[0] - start[0], v_0, v_1, a_0, a_1)
    return np.stack((start[0], v_0, 0.5 * a_0, *highest))


def evaluate_quintic(
    coefficients: FloatArray, duration: float | FloatArray, elapsed: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position, velocity, acceleration, (m, n) each, at times (m,) [s], held at 0 and at the end.

    ``coefficients`` (6, n) are those of :func:`quintic_coefficients` for ``duration`` [s]; or
    (6, m, n) and (m,), one transition for each time.
    """
    s = np.clip(elapsed / duration, 0.0, 1.0)[:, None]
    duration = np.reshape(duration, (-1, 1))
    c_0, c_1, c_2, c_3, c_4, c_5 = coefficients
    position, velocity, acceleration = _evaluate(c_0, c_1, c_2, c_3, c_4, c_5, s)
    velocity /= duration
    acceleration /= duration**2
    return position, velocity, acceleration


def minimum_jerk(share: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The minimum-jerk way from 0 to 1 at a share of its time from 0 to 1, with two derivatives."""
    s = share
    return (
        10 * s**3 - 15 * s**4 + 6 * s**5,
        30 * s**2 - 60 * s**3 + 30 * s**4,
        60 * s - 180 * s**2 + 120 * s**3,
    )


@borrowing
def transition_time(distance: float, acceleration: float, least: float) -> float:
    """Duration [s] of a minimum-jerk transition within ``acceleration``, at least ``least``."""
    return max(least, math.sqrt(PEAK_ACCELERATION * abs(distance) / acceleration))


@borrowing
def _largest_acceleration(
    position: float, velocity: float, acceleration: float, duration: float
) -> float:
    """The largest acceleration of :func:`quintic_to_zero`, its beginning included."""
    slope, bend = velocity * duration, acceleration * duration * duration
    c_3, c_4, c_5 = _compiled_coefficients(-position, slope, 0.0, bend, 0.0)
    largest, square = abs(bend), 4.0 * c_4 * c_4 - 10.0 * c_3 * c_5
    if square >= 0.0:  # where 6 c_3 + 24 c_4 s + 60 c_5 s² is 0
        q = -(2.0 * c_4 + math.copysign(math.sqrt(square), c_4))
        for above, below in ((q, 10.0 * c_5), (c_3, q)):
            if 0.0 < above * below < below * below:
                s = above / below
                value = bend + s * (6.0 * c_3 + s * (12.0 * c_4 + s * 20.0 * c_5))
                largest = max(largest, abs(value))
    return largest / (duration * duration)


@borrowing
def time_to_zero(
    position: float, velocity: float, acceleration: float, most: float, least: float
) -> float:
    """Duration [s] of :func:`quintic_to_zero` within an acceleration ``most``, at least ``least``.

    From rest it is :func:`transition_time`, and longer where what moves has to be braked first. An
    acceleration above ``most`` that it begins with is not exceeded further on.
    """
    duration, bound = transition_time(position, most, least), max(most, abs(acceleration))
    if velocity == 0.0 and acceleration == 0.0:
        return duration
    for _ in range(_TRIALS):
        if _largest_acceleration(position, velocity, acceleration, duration) <= bound:
            break
        duration *= _LONGER
    return duration


def minimum_jerk_time(distance: float, velocity: float, acceleration: float) -> float:
    """The shortest time [s] of a minimum-jerk move within a peak speed and a peak acceleration."""
    size = abs(distance)
    return max(PEAK_VELOCITY * size / velocity, math.sqrt(PEAK_ACCELERATION * size / acceleration))


LEAST_BRAKING = 0.05
"""Shortest time an axis brakes in [s], however near a stop is."""


def coasted(velocity: FloatArray, acceleration: FloatArray | float, time: FloatArray) -> FloatArray:
    """How far a quintic goes, (n,), that comes to rest in a ``time`` [s] as a quartic would."""
    return np.asarray(time * (velocity / 2.0 + time * acceleration / 12.0))


def braking_times(
    position: FloatArray,
    velocity: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    longest: float,
    acceleration: FloatArray | float = 0.0,
) -> FloatArray:
    """How long each axis brakes, shape (n,) [s]: ``longest``, or less where a stop is near.

    From ``position`` at ``velocity`` and ``acceleration``, (n,) each, between stops at ``lower``
    and ``upper``. The quintic that ends where it has :func:`coasted` to then stays within the
    stops, but where even :data:`LEAST_BRAKING` is too long.
    """
    times = np.full(position.shape, longest)
    for sign, room in ((1.0, upper - position), (-1.0, position - lower)):
        speed = 0.5 * np.maximum(sign * velocity, 0.0)
        push = np.maximum(sign * np.asarray(acceleration), 0.0) / 3.0
        way = 0.75 * np.maximum(room, 0.0)
        root = np.maximum(speed + np.sqrt(speed * speed + push * way), 1e-9)
        times = np.where(speed + push > 0.0, np.minimum(times, 2.0 * way / root), times)
    return np.asarray(np.clip(times, LEAST_BRAKING, longest))
