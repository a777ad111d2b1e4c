"""Vibration of the floor, which carries stators and encoders: the platen feels it as inertia.

The vibration criteria (VC curves) give the rms speed in each third octave from 1 to 80 Hz; here
every band is one sinusoid of that speed, in y, x and z with phases of their own. A phasor is turned
by each step, its size kept.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record
from maglev_plant.random_numbers import drawn

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

BANDS: Final = 20
FREQUENCIES: Final = 10.0 ** (np.arange(BANDS) / 10.0)
"""Middles of the third octaves, 1 to 80 Hz."""


class FloorArrays(Record):
    """Phasors of acceleration of y, x, z."""

    on: bool
    turn: Annotated[FloatArray, BANDS, 2]  # cosine and sine of a step's angle
    phasor: Annotated[FloatArray, 3, BANDS, 2]  # [m/s²]
    acceleration: Annotated[FloatArray, 3]  # in the middle of this step [m/s²]


def floor_arrays(parameters: PlantParameters, step: float) -> FloorArrays:
    """The floor at sample 0, for steps of ``step`` [s]."""
    speed = parameters.effects.floor.velocity
    angle = 2.0 * math.pi * FREQUENCIES * step
    phase = drawn(parameters.seed, 'floor').uniform(0.0, 2.0 * math.pi, (3, BANDS)) + 0.5 * angle
    size = math.sqrt(2.0) * speed * 2.0 * math.pi * FREQUENCIES
    return FloorArrays(
        on=speed > 0.0,
        turn=np.stack([np.cos(angle), np.sin(angle)], axis=-1),
        phasor=size[:, None] * np.stack([np.cos(phase), np.sin(phase)], axis=-1),
    )


@borrowing
def shake(floor: FloorArrays) -> None:
    """Go on by a step; written: its acceleration."""
    for axis in range(3):
        total = 0.0
        for k in range(BANDS):
            a, b = floor.phasor[axis, k, 0], floor.phasor[axis, k, 1]
            total += a
            c, s = floor.turn[k, 0], floor.turn[k, 1]
            floor.phasor[axis, k, 0] = c * a - s * b
            floor.phasor[axis, k, 1] = s * a + c * b
        floor.acceleration[axis] = total
