"""The six encoders: four on the vertical guides, which read the motors' gaps by (5), and x and z.

Noise is a function of seed, sample and encoder only, so a run repeats whatever else is drawn.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.compiled import compiled
from maglev_model.machine import machine_from_array
from maglev_plant.arrays import (
    GAP_NOISE,
    GAP_RESOLUTION,
    HORIZONTAL_NOISE,
    HORIZONTAL_RESOLUTION,
    SAMPLE,
    SEED,
    STATE,
    FloatArray,
)

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)


@compiled
def _uniform(key: int) -> float:
    """A number in (0, 1) from an integer, by the finalizer of SplitMix64."""
    bits = np.uint64(key) * _GOLDEN
    bits = (bits ^ (bits >> np.uint64(30))) * _MIX_1
    bits = (bits ^ (bits >> np.uint64(27))) * _MIX_2
    bits ^= bits >> np.uint64(31)
    return (float(bits >> np.uint64(11)) + 0.5) / 9007199254740992.0


@compiled
def gaussian(seed: int, sample: int, channel: int) -> float:
    """A standard normal number that belongs to one seed, sample and channel (0..7)."""
    key = (seed << 32) ^ (sample * 16 + channel * 2)
    radius = math.sqrt(-2.0 * math.log(_uniform(key)))
    return radius * math.cos(2.0 * math.pi * _uniform(key + 1))


@compiled
def _count(value: float, resolution: float) -> float:
    """The nearest whole number of counts, as a length [m]; the value itself at resolution 0."""
    if resolution <= 0.0:
        return value
    return math.floor(value / resolution + 0.5) * resolution


@compiled
def _read(
    value: float, resolution: float, noise: float, seed: int, sample: int, channel: int
) -> float:
    if noise > 0.0:
        value += noise * gaussian(seed, sample, channel)
    return _count(value, resolution)


@compiled
def encode(scalars: FloatArray, memory: FloatArray, reading: FloatArray) -> None:
    """Write what the encoders read now: gaps of motors 1..4, x, z [m], ``reading``, shape (6,)."""
    machine = machine_from_array(scalars)
    seed, sample = int(scalars[SEED]), int(memory[SAMPLE])
    y = memory[STATE]
    tilt_phi = machine.r * math.sin(memory[STATE + 6])
    tilt_theta = machine.r * math.sin(memory[STATE + 8])
    reading[0] = y - tilt_phi
    reading[1] = y + tilt_theta
    reading[2] = y + tilt_phi
    reading[3] = y - tilt_theta
    for i in range(4):
        reading[i] = _read(reading[i], scalars[GAP_RESOLUTION], scalars[GAP_NOISE], seed, sample, i)
    for i in range(2):
        reading[4 + i] = _read(
            memory[STATE + 2 + 2 * i],
            scalars[HORIZONTAL_RESOLUTION],
            scalars[HORIZONTAL_NOISE],
            seed,
            sample,
            4 + i,
        )
