"""The observer of one axis: a steady-state Kalman filter that knows its input.

It carries position and velocity of the double integrator (13) from sample to sample with the
acceleration the currents really give, and corrects them with what the encoders read. Whatever else
acts, friction first of all, it takes for white noise. Less of the counts' steps reaches the
currents than through a derivative filter, and less phase is lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Observer(NamedTuple):
    """What the difference between reading and prediction corrects; 0, 0 for no observer."""

    position: float  # share of the difference
    velocity: float  # [1/s]


NO_OBSERVER = Observer(0.0, 0.0)


def observer(bandwidth: float, period: float) -> Observer:
    """The stationary Kalman gain at sample time ``period`` [s].

    ``bandwidth`` ω [rad/s] is the one figure there is: ω⁴ is the spectral density of the unknown
    acceleration by that of the measurement's error. The filter's poles lie on a circle of that
    radius, Butterworth's, as long as that is far below the sample rate.

    They are the factors inside the unit circle of the measurement's sampled spectrum, a cubic
    B-spline's above the error's: u² + (ωT)⁴ (1 + u / 6) = 0 with u = z − 2 + 1 / z.
    """
    ratio = (bandwidth * period) ** 4
    larger = -ratio / 12.0 - np.sqrt(complex(ratio**2 / 144.0 - ratio))
    u = np.array([larger, ratio / larger])
    away = u / 2.0 + np.sqrt(u + u**2 / 4.0) * np.array([[1.0], [-1.0]])  # z − 1
    outside = away[np.argmax(np.abs(1.0 + away), axis=0), [0, 1]]
    first, second = -outside / (1.0 + outside)
    speed = (first * second).real
    return Observer(float(-(first + second).real - speed), float(speed / period))
