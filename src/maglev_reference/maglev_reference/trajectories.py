"""What the platen follows while it is measured: sums of sinusoids, and sequences of steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maglev_reference.check import UnreachableError
from maglev_reference.geometry import AXES, UNITS, FloatArray
from maglev_reference.parameters import ReferenceParameters, SinusoidParameters
from maglev_reference.profiles import Kinematics, Motion, Quintic, Stand, State


class Sinusoids:
    """Each axis follows offset + sum_i amplitude_i sin(frequency_i t + phase_i), for any time t."""

    def __init__(self, parameters: SinusoidParameters) -> None:
        self._offset = np.array([axis.offset for axis in parameters.axes()])
        self._terms = [
            (index, amplitude, frequency, phase)
            for index, axis in enumerate(parameters.axes())
            for amplitude, frequency, phase in zip(
                axis.amplitude, axis.frequency, axis.phase, strict=True
            )
            if amplitude != 0.0
        ]

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        shape = (len(time), 5)
        position = np.broadcast_to(self._offset, shape).copy()
        velocity = np.zeros(shape)
        acceleration = np.zeros(shape)
        for axis, amplitude, frequency, phase in self._terms:
            angle = frequency * time + phase
            sine = amplitude * np.sin(angle)
            position[:, axis] += sine
            velocity[:, axis] += amplitude * frequency * np.cos(angle)
            acceleration[:, axis] -= frequency**2 * sine
        return Kinematics(position, velocity, acceleration)


class Delayed:
    """A motion whose time ``start`` [s] is this motion's time zero."""

    def __init__(self, motion: Motion, start: float) -> None:
        self._motion = motion
        self._start = start

    def evaluate(self, time: FloatArray) -> Kinematics:
        """The motion at ``time + start``."""
        return self._motion.evaluate(time + self._start)


def trajectory(parameters: ReferenceParameters) -> Motion:
    """The motion of the tracking window; its time zero is where the window begins."""
    if parameters.trajectory == 'sinusoids':
        return Sinusoids(parameters.sinusoids)
    return Stand(np.array(parameters.home))


class Step(NamedTuple):
    """One step: all five outputs (5,) before and after it, and the motion between."""

    start: FloatArray
    target: FloatArray
    motion: Motion
    jumps: bool


def steps(parameters: ReferenceParameters) -> list[Step]:
    """The steps in order. Raises UnreachableError for one larger than the limit of its axis."""
    found = []
    table = parameters.steps
    home = np.array(parameters.home)
    for number, (axis, start, target) in enumerate(
        zip(table.axis, table.start, table.target, strict=True), start=1
    ):
        index = AXES.index(axis)
        limit = parameters.limits.step[index]
        if abs(target - start) > limit * (1.0 + 1e-9):
            raise UnreachableError(
                f'unreachable reference: step {number}, of {axis} from {start:g} to {target:g} '
                f'{UNITS[index]}, is larger than {limit:g} {UNITS[index]} (limits.step)'
            )
        before, after = home.copy(), home.copy()
        before[index], after[index] = start, target
        motion: Motion = Stand(after)
        if table.shaped:
            motion = Quintic(State.at_rest(before), State.at_rest(after), table.shaping_time)
        found.append(Step(before, after, motion, not table.shaped))
    return found
