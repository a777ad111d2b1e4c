"""The six encoders: four on the vertical guides, which read the motors' gaps by (5), and x and z.

Noise is a function of seed, sample and encoder only, so a run repeats whatever else is drawn.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.compiled import compiled
from maglev_model.machine_array import machine_from_array
from maglev_model.records import Block
from maglev_plant.arrays import StageArrays

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
def encode(block: Block) -> None:
    """Write what the encoders read now into ``reading`` of a stage's block."""
    stage: StageArrays = block[0]
    machine = machine_from_array(stage.machine)
    state, reading = stage.state, stage.reading
    y = state[0]
    tilt_phi = machine.r * math.sin(state[6])
    tilt_theta = machine.r * math.sin(state[8])
    reading[0] = y - tilt_phi
    reading[1] = y + tilt_theta
    reading[2] = y + tilt_phi
    reading[3] = y - tilt_theta
    reading[4], reading[5] = state[2], state[4]
    for i in range(6):
        resolution = stage.gap_resolution if i < 4 else stage.horizontal_resolution
        noise = stage.gap_noise if i < 4 else stage.horizontal_noise
        reading[i] = _read(reading[i], resolution, noise, stage.seed, stage.sample, i)
