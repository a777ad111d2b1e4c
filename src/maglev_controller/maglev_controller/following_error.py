"""Whether the platen follows its reference: farther off than a sound machine ever is, it does not.

Where the reference jumps, as steps without shaping do, the error is as large as the jump at first,
and no fault: each jump adds to what is allowed, and what it added fades.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block, Record


class FollowingArrays(Record):
    """What :func:`_follow` takes; axes y, x, z, phi, theta [m, rad]."""

    period: float  # [s]
    fading: float  # what is left of a jump's allowance a sample later
    most: Annotated[FloatArray, 5]  # error of a reference that does not jump
    patience: int  # samples in a row for which it may be larger
    beyond: int  # samples in a row for which it has been
    jumped: Annotated[FloatArray, 5]  # what jumps allow for now
    position: Annotated[FloatArray, 5]  # of the reference, a sample ago
    velocity: Annotated[FloatArray, 5]
    begun: bool


@borrowing
def _follow(block: Block, position: FloatArray, velocity: FloatArray, error: FloatArray) -> int:
    """The first axis with too large an error, for too long, or -1."""
    f: FollowingArrays = block[0]
    failed = -1
    for axis in range(5):
        if f.begun:
            moved = 0.5 * f.period * (velocity[axis] + f.velocity[axis])
            f.jumped[axis] += abs(position[axis] - f.position[axis] - moved)
        else:
            f.jumped[axis] = abs(error[axis])
        if failed < 0 and not abs(error[axis]) <= f.most[axis] + f.jumped[axis]:
            failed = axis
        f.jumped[axis] *= f.fading
        f.position[axis], f.velocity[axis] = position[axis], velocity[axis]
    f.begun = True
    f.beyond = f.beyond + 1 if failed >= 0 else 0
    return failed if f.beyond > f.patience else -1


class FollowingWatch:
    """Compares the error with what is allowed, once a sample."""

    def __init__(self, parameters: ControllerParameters) -> None:
        self._arrays = FollowingArrays()
        self._grace = 0.0
        self.tune(parameters)
        self.reset()

    def tune(self, parameters: ControllerParameters) -> None:
        """Go by other parameters from now on, without forgetting jumps, nor errors so far."""
        table, period = parameters.following, parameters.sample_time
        controlled = [axis.controlled for axis in parameters.axes]
        arrays, self._time = self._arrays, table.time
        arrays.period, arrays.fading = period, math.exp(-period / table.fading)
        arrays.most[:] = np.where(controlled, table.error, math.inf)
        self._wait(self._grace)

    def reset(self, grace: float = 0.0) -> None:
        """Begin anew: the first error is no fault, nor a larger one for less than ``grace`` [s]."""
        self._arrays.begun, self._arrays.beyond = False, 0
        self._wait(grace)

    def _wait(self, grace: float) -> None:
        self._grace = grace
        self._arrays.patience = round(max(self._time, grace) / self._arrays.period)

    def step(self, position: FloatArray, velocity: FloatArray, error: FloatArray) -> str:
        """Take a sample: the reference's position and velocity, and the error, each (5,).

        Returns why the platen does not follow, or ''.
        """
        axis = _follow(self._arrays.block, position, velocity, error)
        if axis < 0:
            return ''
        return (
            f'{AXES[axis]} is {abs(error[axis]):.5f} {UNITS[axis]} from its reference, more than'
            f" 'following.error' allows"
        )
