"""The observer of one axis: a steady-state Kalman filter that knows its input.

It carries position and velocity of the double integrator (13) from sample to sample with the
acceleration the currents really give, and corrects them with what the encoders read. Whatever else
acts, friction first of all, it takes for white noise. Less of the counts' steps reaches the
currents than through a derivative filter, and less phase is lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are


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
    """
    state = np.array([[1.0, period], [0.0, 1.0]])
    noise = bandwidth**4 * np.array([[period**3 / 3.0, period**2 / 2.0], [period**2 / 2.0, period]])
    seen, reading = np.eye(2, 1), 1.0 / period
    covariance = solve_discrete_are(state.T, seen, noise, np.array([[reading]]))
    position, velocity = covariance[:, 0] / (covariance[0, 0] + reading)
    return Observer(float(position), float(velocity))
