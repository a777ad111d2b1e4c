"""From commanded phase currents to what the current loops aim at: converter, amplifier, latency.

A command passes the converter (bits over a range), the amplifier's gain, offset and noise, and
takes effect ``latency`` samples later: within a sample first the older command, then the newer; a
step that sees both aims at their mean by time.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.compiled.records import Record
from maglev_plant.random_numbers import drawn, gaussian_of

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

HISTORY: Final = 5
_STREAM: Final = 1


class DriveArrays(Record):
    """Phases a, b, c of motor 1, then 2, 3, 4."""

    count: float  # of the converter [A], 0 for none
    range: float  # [A]
    gain: Annotated[FloatArray, 12]
    offset: Annotated[FloatArray, 12]  # [A]
    noise: float  # [A]
    latency: float  # [samples]
    history: Annotated[FloatArray, HISTORY, 12]  # newest first [A]


def drive_arrays(parameters: PlantParameters) -> DriveArrays:
    """Converters and amplifiers of a stage, spread by its seed."""
    drive, draw = parameters.effects.drive, drawn(parameters.seed, 'drive')
    spread = draw.standard_normal((2, 12))
    return DriveArrays(
        count=2.0 * drive.dac_range / 2.0**drive.dac_bits if drive.dac_bits else 0.0,
        range=drive.dac_range,
        gain=np.array(drive.gain) + drive.gain_spread * spread[0],
        offset=np.array(drive.offset) + drive.offset_spread * spread[1],
        noise=drive.noise,
        latency=drive.latency,
    )


@compiled
def command_phases(drive: DriveArrays, seed: int, sample: int, wanted: FloatArray) -> None:
    """Take one sample's phase currents ``wanted`` (12,) [A] as the newest command."""
    for k in range(HISTORY - 1, 0, -1):
        copy_to(drive.history[k - 1], drive.history[k])
    for phase in range(12):
        current = wanted[phase]
        if drive.count > 0.0:
            counts = math.floor(current / drive.count + 0.5)
            full = math.floor(drive.range / drive.count + 0.5)
            current = min(max(counts, -full), full - 1.0) * drive.count
        current = drive.gain[phase] * current + drive.offset[phase]
        if drive.noise > 0.0:
            current += drive.noise * gaussian_of(_STREAM, seed, sample, phase)
        drive.history[0, phase] = current


@compiled
def aim(drive: DriveArrays, begin: float, end: float, target: FloatArray) -> None:
    """Write what is aimed at between two shares of a sample, ``target`` (12,) [A]."""
    if drive.latency == 0.0:
        copy_to(drive.history[0], target)
        return
    target[:] = 0.0
    for k in range(HISTORY):
        first = max(begin, drive.latency - k)
        last = min(end, drive.latency - k + 1.0)
        if k == 0:
            last = end
        if last > first:
            target += (last - first) / (end - begin) * drive.history[k]
