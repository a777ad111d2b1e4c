"""Flexible modes: what the encoders read beside the rigid platen.

In modal coordinates a mode answers the axis' acceleration a by itself,
``q̈ + 2ζω q̇ + ω² q = a``, and the encoder of the axis reads its position + κ q: from acceleration
to reading, ``1/s² + κ/(s² + 2ζωs + ω²)``. κ > 0 is a mode that motor and encoder see alike, κ < 0
one between them. Each step is carried exactly, with the mean acceleration of the step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

MOST: Final = 16


class ModeArrays(Record):
    """The modes that have a gain."""

    number: int
    axis: Annotated[NDArray[np.int64], MOST]
    gain: Annotated[FloatArray, MOST]
    transition: Annotated[FloatArray, MOST, 2, 2]  # of (q, q̇) over a step
    answer: Annotated[FloatArray, MOST, 2]  # to an acceleration of 1 over a step
    state: Annotated[FloatArray, MOST, 2]  # q [s² times m/s² or rad/s²], q̇


def mode_arrays(parameters: PlantParameters, step: float) -> ModeArrays:
    """The modes at rest, for steps of ``step`` [s]."""
    given, arrays = parameters.effects.modes, ModeArrays()
    for axis, frequency, damping, gain in zip(
        given.axis, given.frequency, given.damping, given.gain, strict=True
    ):
        if gain == 0.0:
            continue
        k = arrays.number
        w = 2.0 * math.pi * frequency
        transition = _transition(w, damping, step)
        arrays.axis[k], arrays.gain[k] = AXES.index(axis), gain
        arrays.transition[k] = transition
        arrays.answer[k] = (np.array([1.0, 0.0]) - transition[:, 0]) / w**2
        arrays.number = k + 1
    return arrays


def _transition(w: float, damping: float, step: float) -> FloatArray:
    """exp of [[0, 1], [-w², -2ζw]] times the step."""
    decay = math.exp(-damping * w * step)
    ringing = w * math.sqrt(max(1.0 - damping**2, 1e-12))
    cosine, sine = math.cos(ringing * step), math.sin(ringing * step) / ringing
    return decay * np.array(
        [[cosine + damping * w * sine, sine], [-(w**2) * sine, cosine - damping * w * sine]]
    )


@borrowing
def carry_modes(modes: ModeArrays, before: FloatArray, state: FloatArray, step: float) -> None:
    """Let the modes answer a step of the platen from state ``before``."""
    for k in range(modes.number):
        speed = 2 * modes.axis[k] + 1
        a = (state[speed] - before[speed]) / step
        q, rate = modes.state[k, 0], modes.state[k, 1]
        f = modes.transition[k]
        modes.state[k, 0] = f[0, 0] * q + f[0, 1] * rate + modes.answer[k, 0] * a
        modes.state[k, 1] = f[1, 0] * q + f[1, 1] * rate + modes.answer[k, 1] * a


@borrowing
def add_deflections(modes: ModeArrays, output: FloatArray) -> None:
    """Add what the modes make the encoders read to y, x, z, phi, theta (5,)."""
    for k in range(modes.number):
        output[modes.axis[k]] += modes.gain[k] * modes.state[k, 0]
