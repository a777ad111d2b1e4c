"""Motions, and the minimum-jerk (quintic) profile that joins one state to another.

A motion gives position, velocity and acceleration of the five outputs at any array of times.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from maglev_model.axes import FloatArray

PEAK_VELOCITY = 15.0 / 8.0  # of a minimum-jerk move, times distance / time
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)  # times distance / time^2
PEAK_JERK = 60.0  # times distance / time^3


class Kinematics(NamedTuple):
    """Position [m, rad], velocity [m/s, rad/s], acceleration [m/s^2, rad/s^2], each (n, 5)."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


class State(NamedTuple):
    """Position, velocity and acceleration at one instant, each (5,)."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray

    @classmethod
    def at_rest(cls, position: FloatArray) -> State:
        """Standing still at ``position`` (5,)."""
        return cls(np.array(position, dtype=float), np.zeros(5), np.zeros(5))


class Motion(Protocol):
    """What a segment of the reference follows; ``time`` (n,) [s] counts from the motion's start."""

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time."""
        ...


def state_at(motion: Motion, time: float) -> State:
    """The state of a motion at one time [s]."""
    found = motion.evaluate(np.array([time]))
    return State(found.position[0], found.velocity[0], found.acceleration[0])


class Stand:
    """Standing still at one position (5,)."""

    def __init__(self, position: FloatArray) -> None:
        self._position = np.array(position, dtype=float)

    def evaluate(self, time: FloatArray) -> Kinematics:
        """The same position at each time (n,), velocity and acceleration zero."""
        shape = (len(time), 5)
        return Kinematics(
            np.broadcast_to(self._position, shape).copy(), np.zeros(shape), np.zeros(shape)
        )


class Quintic:
    """The quintic from one state to another in ``duration`` [s]; from rest to rest, minimum jerk.

    It matches position, velocity and acceleration at both ends, so that it blends out of and into
    moving trajectories. From its end on the end state stays, which makes sense for one at rest.
    Raises ValueError unless ``duration`` is positive.
    """

    def __init__(self, start: State, end: State, duration: float) -> None:
        if not duration > 0.0:
            raise ValueError(f'a move takes a positive time, not {duration} s')
        self.duration = duration
        self.end = end
        distance = end.position - start.position
        v_0, v_1 = start.velocity * duration, end.velocity * duration
        a_0, a_1 = start.acceleration * duration**2, end.acceleration * duration**2
        self._coefficients = np.stack(
            (
                start.position,
                v_0,
                0.5 * a_0,
                10.0 * distance - 6.0 * v_0 - 4.0 * v_1 - 1.5 * a_0 + 0.5 * a_1,
                -15.0 * distance + 8.0 * v_0 + 7.0 * v_1 + 1.5 * a_0 - a_1,
                6.0 * distance - 3.0 * (v_0 + v_1) - 0.5 * (a_0 - a_1),
            )
        )

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s], 0 being the start."""
        s = np.clip(time / self.duration, 0.0, 1.0)[:, None]
        c_0, c_1, c_2, c_3, c_4, c_5 = self._coefficients
        position = c_0 + s * (c_1 + s * (c_2 + s * (c_3 + s * (c_4 + s * c_5))))
        velocity = c_1 + s * (2.0 * c_2 + s * (3.0 * c_3 + s * (4.0 * c_4 + s * 5.0 * c_5)))
        acceleration = 2.0 * c_2 + s * (6.0 * c_3 + s * (12.0 * c_4 + s * 20.0 * c_5))
        velocity /= self.duration
        acceleration /= self.duration**2
        over = time >= self.duration
        position[over] = self.end.position
        velocity[over] = self.end.velocity
        acceleration[over] = self.end.acceleration
        return Kinematics(position, velocity, acceleration)


def minimum_jerk_peaks(distance: float, time: float) -> tuple[float, float, float]:
    """Peak speed, acceleration and jerk of a minimum-jerk move of ``distance`` in ``time`` [s]."""
    size = abs(distance)
    return (
        PEAK_VELOCITY * size / time,
        PEAK_ACCELERATION * size / time**2,
        PEAK_JERK * size / time**3,
    )


def minimum_jerk_time(distance: float, velocity: float, acceleration: float) -> float:
    """The shortest time [s] of a minimum-jerk move within a peak speed and a peak acceleration."""
    size = abs(distance)
    return max(PEAK_VELOCITY * size / velocity, math.sqrt(PEAK_ACCELERATION * size / acceleration))
