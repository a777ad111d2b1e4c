"""References for the closed loop as a library: set-points, moves between them, the ellipse."""

from __future__ import annotations

import math
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
