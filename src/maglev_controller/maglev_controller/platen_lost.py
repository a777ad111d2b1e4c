"""Whether the platen still follows: pressed against a stop, far from its reference, it is lost."""

from __future__ import annotations

import math

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES, PHI, UNITS, FloatArray
from maglev_model.compiled import compiled


@compiled
def _pressed(
    position: FloatArray, error: FloatArray, lower: FloatArray, upper: FloatArray, far: FloatArray
) -> int:
    """The first output at or beyond ``lower`` or ``upper`` with an error above ``far``; or -1."""
    for axis in range(5):
        if abs(error[axis]) > far[axis] and not lower[axis] < position[axis] < upper[axis]:
            return axis
    return -1


class PlatenWatch:
    """Counts the samples in a row for which an output is at a stop and far from its reference."""

    def __init__(self, parameters: ControllerParameters) -> None:
        table, machine = parameters.lost, parameters.machine
        near = np.full(5, table.distance)
        near[PHI:] /= machine.radius
        self._lower = np.array(machine.lower_limit) + near
        self._upper = np.array(machine.upper_limit) - near
        controlled = [axis.controlled for axis in parameters.axes]
        self._far = np.where(controlled, table.error, math.inf)
        self._most = max(1, round(table.time / parameters.sample_time))
        self._time = table.time
        self._samples = 0

    def reset(self) -> None:
        """Count anew."""
        self._samples = 0

    def step(self, position: FloatArray, error: FloatArray) -> str:
        """Take a sample, ``position`` and ``error`` (5,) [m, rad]; why it is lost, or ''."""
        axis = _pressed(position, error, self._lower, self._upper, self._far)
        self._samples = self._samples + 1 if axis >= 0 else 0
        if self._samples < self._most:
            return ''
        self._samples = 0
        return (
            f'the platen is lost: for {self._time:g} s at a stop, {AXES[axis]} is at'
            f' {position[axis]:.5f} {UNITS[axis]}, {abs(error[axis]):.5f} {UNITS[axis]} from its'
            ' reference'
        )
