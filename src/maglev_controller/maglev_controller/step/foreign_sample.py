"""A sample that a law of somebody else's answers, compiled: what surrounds the call of that law.

The regulator's own law computes its w all the same, and is told what acts instead of it as it is of
currents that were limited. So its observers and internal models stay where the platen is, and it
can take over at any sample without a jump.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from maglev_controller.step.arrays import ControlArrays, Currents, Reading, Reference
from maglev_controller.step.sample import OK, conclude, currents_of_w, decide
from maglev_controller.step.voltage import keep_within_voltage
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.inverse import CURRENT, clip
from maglev_model.machine_array import machine_from_array
from maglev_model.platen import output_accelerations

TOLD = 5
"""Rows of what a law is told: position and velocity of the platen, then those of the reference and
its acceleration, (5,) each."""


@borrowing
def open_sample(
    records: NDArray[np.void],
    models: NDArray[np.void],
    transition: FloatArray,
    xi: FloatArray,
    gap: FloatArray,
    x: float,
    z: float,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    told: FloatArray,
) -> int:
    """All that comes before the law; ``told`` (5, 5) is written. A fault code, or 0."""
    settings, sample, axes = records[0].settings, records[0].sample, records[0].axes
    machine = machine_from_array(settings.machine)
    reading, reference = Reading(gap, x, z), Reference(position, velocity, acceleration)
    code = decide(ControlArrays(records, models, transition, xi), machine, reading, reference)
    if code != OK:
        return code
    for index in range(5):
        axis = axes[index]
        before = axis.smooth_velocity if settings.observed[index] else axis.filtered_velocity
        told[0, index] = sample.position[index]
        told[1, index] = sample.error_rate[index] + before
        told[2, index] = axis.smooth_position
        told[3, index] = axis.smooth_velocity
        told[4, index] = axis.wanted_acceleration
    return OK


@borrowing
def close_with_input(
    records: NDArray[np.void],
    models: NDArray[np.void],
    transition: FloatArray,
    xi: FloatArray,
    wanted: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
) -> int:
    """Answer it by the inverse of the accelerations ``wanted`` (5,); what limited the currents.

    The regulator's own answer is that to its own w, ``virtual_input`` of the sample.
    """
    settings, sample, axes = records[0].settings, records[0].sample, records[0].axes
    machine = machine_from_array(settings.machine)
    w = sample.virtual_input
    by_itself = (w[0], w[1], w[2], w[3], w[4])
    for index in range(5):
        w[index] = wanted[index]
    limited_by = currents_of_w(settings, machine, sample, axes, Currents(direct, quadrature))
    for index in range(5):
        w[index] = by_itself[index]
    conclude(ControlArrays(records, models, transition, xi))
    for index in range(5):
        w[index] = wanted[index]
    return limited_by


@borrowing
def _within_amplitude(limit: float, direct: FloatArray, quadrature: FloatArray) -> int:
    """Limit each motor's amplitude; i_q yields to the i_d that carries the platen."""
    limited_by = 0
    for motor in range(4):
        if math.hypot(direct[motor], quadrature[motor]) > limit:
            limited_by = CURRENT
            direct[motor] = i_d = clip(direct[motor], limit)
            left = math.sqrt(max(limit * limit - i_d * i_d, 0.0))
            quadrature[motor] = clip(quadrature[motor], left)
    return limited_by


@compiled
def close_with_currents(
    records: NDArray[np.void],
    models: NDArray[np.void],
    transition: FloatArray,
    xi: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
) -> int:
    """Answer it by the currents that are given, within their limits; what limited them.

    What they realise is what the model (6), (7) makes of them.
    """
    settings, sample, axes = records[0].settings, records[0].sample, records[0].axes
    machine = machine_from_array(settings.machine)
    limited_by = _within_amplitude(settings.current, direct, quadrature)
    made = output_accelerations(
        machine, sample.position[0], sample.position[3], sample.position[4], direct, quadrature
    )
    for index in range(5):
        sample.realised[index] = made[index]
    sample.excess[:] = 0.0
    if keep_within_voltage(settings, machine, sample, axes, direct, quadrature):
        limited_by |= CURRENT
    conclude(ControlArrays(records, models, transition, xi))
    copy_to(sample.realised, sample.virtual_input)
    return limited_by


def warm_up(arrays: ControlArrays, gives_currents: bool) -> None:
    """Compile, or load what was compiled: a law that fails in flight cannot wait for that.

    ``arrays`` stay as they are.
    """
    copies = ControlArrays(*(array.copy() for array in arrays))
    zero, currents = np.zeros(5), np.zeros((2, 4))
    open_sample(*copies, np.zeros(4), 0.0, 0.0, zero, zero, zero, np.empty((TOLD, 5)))
    close_with_input(*copies, zero, *currents)
    if gives_currents:
        close_with_currents(*copies, *currents)
