"""The six encoders: four on the vertical guides, which read the motors' gaps by (5), and x and z.

Noise is a function of seed, sample and encoder only, so a run repeats whatever else is drawn.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.records import Block
from maglev_model.machine import Machine
from maglev_model.machine_array import machine_from_array
from maglev_model.platen import motor_gaps
from maglev_plant.arrays import StageArrays
from maglev_plant.effects.modes import add_deflections
from maglev_plant.effects.sensor import count_lengths, late_by, note_own, read_lengths
from maglev_plant.random_numbers import gaussian


@borrowing
def _count(value: float, resolution: float) -> float:
    """The nearest whole number of counts, as a length [m]; the value itself at resolution 0."""
    if resolution <= 0.0:
        return value
    return math.floor(value / resolution + 0.5) * resolution


@borrowing
def _read(
    value: float, resolution: float, noise: float, seed: int, sample: int, channel: int
) -> float:
    if noise > 0.0:
        value += noise * gaussian(seed, sample, channel)
    return _count(value, resolution)


@compiled
def _encode_rough(stage: StageArrays, machine: Machine) -> None:
    """What the encoders of a real stage read."""
    sensor = stage.effects.sensor
    output = stage.state[::2].copy()
    add_deflections(stage.effects.modes, output)
    read_lengths(sensor, output, np.zeros(5), machine.r, stage.reading)
    note_own(sensor, stage.reading)
    late = late_by(sensor, stage.seed, stage.sample)
    if late != 0.0:
        read_lengths(sensor, output, late * stage.state[1::2], machine.r, stage.reading)
    count_lengths(sensor, stage.seed, stage.sample, stage.reading)


@borrowing
def encode(block: Block) -> None:
    """Write what the encoders read now into ``reading`` of a stage's block."""
    stage: StageArrays = block[0]
    machine = machine_from_array(stage.machine)
    if stage.effects.sensor.on:
        _encode_rough(stage, machine)
        return
    state, reading = stage.state, stage.reading
    gaps = motor_gaps(machine, state[0], state[6], state[8])
    reading[0], reading[1], reading[2], reading[3] = gaps
    reading[4], reading[5] = state[2], state[4]
    for i in range(6):
        stage.effects.sensor.own[i] = reading[i]
        resolution = stage.gap_resolution if i < 4 else stage.horizontal_resolution
        noise = stage.gap_noise if i < 4 else stage.horizontal_noise
        reading[i] = _read(reading[i], resolution, noise, stage.seed, stage.sample, i)
