"""Whether a reference can be followed at all: within the stops, finite.

The reference's own node refuses what cannot. This is for whatever else speaks in its place: beyond
a stop a law only pushes the platen against it.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.sample import LARGEST_REFERENCE
from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block, Record


class ReachArrays(Record):
    """What :func:`_unreachable` takes; axes y, x, z, phi, theta [m, rad]."""

    lower: Annotated[FloatArray, 5]
    upper: Annotated[FloatArray, 5]


@borrowing
def _unreachable(
    block: Block, position: FloatArray, velocity: FloatArray, acceleration: FloatArray
) -> int:
    """The first axis that cannot be followed, or -1."""
    reach: ReachArrays = block[0]
    for axis in range(5):
        if not reach.lower[axis] <= position[axis] <= reach.upper[axis]:
            return axis
        if not abs(velocity[axis]) + abs(acceleration[axis]) < LARGEST_REFERENCE:
            return axis
    return -1


class ReferenceReach:
    """The stops, and a margin beyond them: as far as the encoders may read."""

    def __init__(self, parameters: ControllerParameters) -> None:
        lower, upper = parameters.reach
        self._arrays = ReachArrays(lower=lower, upper=upper)

    def fault(self, position: FloatArray, velocity: FloatArray, acceleration: FloatArray) -> str:
        """Why a reference (5,) [m, rad], with its derivatives (5,), cannot be followed, or ''."""
        axis = _unreachable(self._arrays.block, position, velocity, acceleration)
        if axis < 0:
            return ''
        name, unit = AXES[axis], UNITS[axis]
        if not np.isfinite(position[axis] + velocity[axis] + acceleration[axis]):
            return f'the reference of {name} is not finite'
        low, high = self._arrays.lower[axis], self._arrays.upper[axis]
        if low <= position[axis] <= high:
            return f'the reference of {name} moves beyond any machine'
        return (
            f'the reference of {name} is {position[axis]:.6g} {unit}, beyond the stops: it must lie'
            f' in [{low:.6g}, {high:.6g}] {unit}'
        )
