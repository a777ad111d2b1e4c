"""References for the closed loop as a library: set-points, moves between them, the ellipse."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.loop_parameters import REFERENCE_FREQUENCY
from maglev_model.quintic import minimum_jerk

HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
"""Where the platen hovers, y, x, z, phi, theta [m, rad]."""

_AMPLITUDE = (0.005, 0.03, 0.03, 0.0)  # of y, x, z, phi on the ellipse [m, rad]
_PHASE = np.array([-math.pi / 2, -math.pi / 2, 0.0, 0.0, 0.0])


class References(NamedTuple):
    """A reference for n samples, (n, 5) each: y, x, z, phi, theta [m, rad] and derivatives."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


def held(position: FloatArray, duration: float, period: float) -> References:
    """A set-point (5,) held for ``duration`` [s], a sample every ``period`` [s]."""
    n = round(duration / period)
    return References(np.tile(position, (n, 1)), np.zeros((n, 5)), np.zeros((n, 5)))


def shaped(
    start: FloatArray, goal: FloatArray, time: float, hold: float, period: float
) -> References:
    """Minimum-jerk from one set-point (5,) to another in ``time``, then held for ``hold`` [s]."""
    elapsed = np.minimum(period * np.arange(round((time + hold) / period)) / time, 1.0)[:, None]
    position, velocity, acceleration = minimum_jerk(elapsed)
    way = goal - start
    return References(start + way * position, way / time * velocity, way / time**2 * acceleration)


def confined(references: References, moves: Sequence[bool]) -> References:
    """The same, but each axis that does not move, y, x, z, phi, theta, stays where it hovers."""
    position, velocity, acceleration = references
    return References(
        np.where(moves, position, HOVER),
        np.where(moves, velocity, 0.0),
        np.where(moves, acceleration, 0.0),
    )


def joined(*parts: References) -> References:
    """References one after another."""
    return References(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def ellipse_at(angle: FloatArray | float, theta: float) -> References:
    """The paper's ellipse at angles ω0 t [rad], (n, 1), or at one, which gives (5,) each.

    In 3DOF with an amplitude ``theta`` of 0, in 4DOF with 0.01 rad.
    """
    amplitude, angle = np.array([*_AMPLITUDE, theta]), angle + _PHASE
    return References(
        HOVER + amplitude * np.sin(angle),
        amplitude * REFERENCE_FREQUENCY * np.cos(angle),
        -amplitude * REFERENCE_FREQUENCY**2 * np.sin(angle),
    )


def ellipse(duration: float, theta: float, period: float, grow: float = 0.0) -> References:
    """The ellipse for ``duration``, a sample every ``period`` [s]; ``theta`` as above.

    With ``grow`` [s] it begins at rest at 25 mm and has its size after that time.
    """
    samples = np.arange(round(duration / period), dtype=np.float64)[:, None]
    if grow > 0.0:
        return _growing_ellipse(period * samples, theta, grow)
    return ellipse_at(REFERENCE_FREQUENCY * period * samples, theta)


def _growing_ellipse(time: FloatArray, theta: float, grow: float) -> References:
    omega, amplitude = REFERENCE_FREQUENCY, np.array([*_AMPLITUDE, theta])
    angle = omega * time + _PHASE
    scale, rate, bend = minimum_jerk(np.minimum(time / grow, 1.0))
    rate, bend = rate / grow, bend / grow**2
    sine, cosine = amplitude * np.sin(angle), amplitude * omega * np.cos(angle)
    return References(
        HOVER + scale * sine,
        rate * sine + scale * cosine,
        bend * sine + 2.0 * rate * cosine - scale * omega**2 * sine,
    )


def scan(way: FloatArray, speed: FloatArray, passes: int, period: float) -> References:
    """To and fro about 25 mm at constant speed, from one end, ``passes`` times each way.

    ``way`` (5,) to each side and mean ``speed`` (5,), by which all axes must take one time; an axis
    with no speed stands. In the first and the last tenth of each way the speed turns smoothly.
    """
    moving = speed > 0.0
    half = float(np.max(2.0 * way[moving] / speed[moving]))
    n = round(half / period)
    share = np.arange(n) / n
    turn = np.clip(np.minimum(share, 1.0 - share) / 0.1, 0.0, 1.0)
    profile, slope, _ = minimum_jerk(turn)
    slope = slope * np.where(share < 0.5, 1.0, -1.0) * (turn < 1.0) / 0.1
    profile, slope = profile / profile.mean(), slope / profile.mean()
    place = np.concatenate([[0.0], np.cumsum(profile)[:-1]]) / n
    there = np.stack([place, profile / half, slope / half**2])
    back = np.stack([1.0 - place, -profile / half, -slope / half**2])
    course = np.concatenate([there, back] * passes, axis=1)[:, :, None] * (2.0 * way * moving)
    start = HOVER - way * moving
    return References(start + course[0], course[1], course[2])
