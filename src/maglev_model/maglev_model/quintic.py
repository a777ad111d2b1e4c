"""Quintic transitions: from any position, velocity and acceleration to rest or motion, smoothly."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from maglev_model.compiled import compiled

FloatArray = NDArray[np.float64]

PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
"""Peak acceleration of a minimum-jerk transition between rests, in distance / duration²."""


@compiled
def quintic_to_zero(
    position: float, velocity: float, acceleration: float, duration: float, elapsed: float
) -> tuple[float, float, float]:
    """Position, velocity, acceleration at ``elapsed`` [s] of the quintic that ends at rest in zero.

    It starts at 0 s with the given values and reaches zero, with zero velocity and acceleration, at
    ``duration`` [s]; from rest it is the minimum-jerk profile. Zero from then on.
    """
    if elapsed >= duration:
        return 0.0, 0.0, 0.0
    slope, bend = velocity * duration, acceleration * duration * duration
    c_2 = 0.5 * bend
    c_3 = -10.0 * position - 6.0 * slope - 1.5 * bend
    c_4 = 15.0 * position + 8.0 * slope + 1.5 * bend
    c_5 = -6.0 * position - 3.0 * slope - 0.5 * bend
    s = elapsed / duration
    value = position + s * (slope + s * (c_2 + s * (c_3 + s * (c_4 + s * c_5))))
    first = slope + s * (2.0 * c_2 + s * (3.0 * c_3 + s * (4.0 * c_4 + s * 5.0 * c_5)))
    second = 2.0 * c_2 + s * (6.0 * c_3 + s * (12.0 * c_4 + s * 20.0 * c_5))
    return value, first / duration, second / (duration * duration)


@compiled
def transition_time(distance: float, acceleration: float, least: float) -> float:
    """Duration [s] of a minimum-jerk transition within ``acceleration``, at least ``least``."""
    return max(least, math.sqrt(PEAK_ACCELERATION * abs(distance) / acceleration))
