"""Motions: position, velocity and acceleration of the five outputs at any array of times."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import describe_error
from maglev_model.quintic import evaluate_quintic, quintic_coefficients


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


class Checked:
    """A motion of somebody else's, who is ``given`` by a parameter: it gives what it must."""

    def __init__(self, motion: Motion, given: str) -> None:
        self._motion = motion
        self._given = given

    def evaluate(self, time: FloatArray) -> Kinematics:
        """What the motion gives; raises ParameterError where that is none."""
        try:
            found = Kinematics(*map(np.asarray, self._motion.evaluate(time)))
        except Exception as error:
            raise ParameterError(
                f'{self._given}, whose motion raised {describe_error(error)}'
            ) from error
        for name, part in zip(Kinematics._fields, found, strict=True):
            if part.shape != (len(time), 5) or part.dtype.kind not in 'fi':
                raise ParameterError(
                    f'{self._given}, whose motion gives a {name} of shape {part.shape} and type '
                    f'{part.dtype} at {len(time)} times: it must be {(len(time), 5)}, of floats'
                )
        return Kinematics(*(part.astype(np.float64) for part in found))


def state_at(motion: Motion, time: float) -> State:
    """The state of a motion at one time [s]."""
    instant = motion.evaluate(np.array([time]))
    return State(instant.position[0], instant.velocity[0], instant.acceleration[0])


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
        self._coefficients = quintic_coefficients(start, end, duration)

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s], 0 being the start."""
        position, velocity, acceleration = evaluate_quintic(self._coefficients, self.duration, time)
        over = time >= self.duration
        position[over] = self.end.position
        velocity[over] = self.end.velocity
        acceleration[over] = self.end.acceleration
        return Kinematics(position, velocity, acceleration)
