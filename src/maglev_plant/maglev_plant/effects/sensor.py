"""What the encoders read beside the truth: scale, cycle, count and instant.

In this order: the modes' deflection, squareness, the instant of the sample, the scale's error,
``q sin(2π ℓ/P) + i sin(4π ℓ/P + channel)`` of its cycle P, noise, the phase within a count, the
count. An offset in quadrature of δ electrical degrees is ``P δ/360`` once a cycle.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Record
from maglev_plant.effects.foreign import call_sensor, sensor_address
from maglev_plant.random_numbers import drawn, gaussian, gaussian_of

if TYPE_CHECKING:
    from maglev_plant.parameters import PlantParameters

_STREAM: Final = 2


class SensorArrays(Record):
    """The encoders, gaps of motors 1..4, x, z."""

    on: bool  # whether one of these effects, or a mode, is
    floor: bool  # count down instead of to the nearest
    resolution: Annotated[FloatArray, 6]  # [m]
    noise: Annotated[FloatArray, 6]  # [m]
    phase: Annotated[FloatArray, 6]  # [counts]
    wave: float  # 2 pi / cycle [rad/m]
    once: float  # [m]
    twice: float  # [m]
    scale: Annotated[FloatArray, 6]
    squareness: Annotated[FloatArray, 3]  # x of z, gaps of x, gaps of z [rad]
    jitter: float  # [s]
    address: int  # of the foreign model, 0 for none
    memory: Annotated[FloatArray, 6, 4]
    own: Annotated[FloatArray, 6]  # lengths now on the encoders' own scales, effects or not [m]


def sensor_arrays(parameters: PlantParameters) -> SensorArrays:
    """Encoders of a stage, their phases drawn by its seed."""
    given, encoder = parameters.effects.sensor, parameters.encoder
    phase = np.array(given.phase)
    if given.random_phase:
        phase = phase + drawn(parameters.seed, 'phase').uniform(-0.5, 0.5, 6)
    pairs = np.array([4, 2])
    return SensorArrays(
        on=given != type(given)() or any(parameters.effects.modes.gain),
        floor=given.rounding == 'floor',
        resolution=np.repeat([encoder.gap_resolution, encoder.horizontal_resolution], pairs),
        noise=np.repeat([encoder.gap_noise, encoder.horizontal_noise], pairs),
        phase=phase,
        wave=2.0 * math.pi / given.cycle,
        once=given.quadrature_error,
        twice=given.interpolation_error,
        scale=given.scale,
        squareness=given.squareness,
        jitter=given.sampling_jitter,
        address=sensor_address(given.model) if given.model else 0,
    )


@borrowing
def read_lengths(
    sensor: SensorArrays, output: FloatArray, rate: FloatArray, radius: float, reading: FloatArray
) -> None:
    """Lengths (6,) [m] along guides that are not square, from y, x, z, phi, theta (5,).

    ``rate`` (5,) is what the outputs change by in the time the sample is late.
    """
    y, x, z = output[0] + rate[0], output[1] + rate[1], output[2] + rate[2]
    tilt_phi = radius * math.sin(output[3] + rate[3])
    tilt_theta = radius * math.sin(output[4] + rate[4])
    y += sensor.squareness[1] * x + sensor.squareness[2] * z
    reading[0], reading[1] = y - tilt_phi, y + tilt_theta
    reading[2], reading[3] = y + tilt_phi, y - tilt_theta
    reading[4], reading[5] = x + sensor.squareness[0] * z, z


@borrowing
def late_by(sensor: SensorArrays, seed: int, sample: int) -> float:
    """How late this sample is taken [s], negative for early."""
    if sensor.jitter == 0.0:
        return 0.0
    return sensor.jitter * gaussian_of(_STREAM, seed, sample, 0)


@borrowing
def _on_scale(sensor: SensorArrays, i: int, length: float) -> float:
    """A length as the scale of encoder ``i`` has it, zero aside."""
    length *= 1.0 + sensor.scale[i]
    angle, error = sensor.wave * length, 0.0
    if sensor.once > 0.0:
        error += sensor.once * math.sin(angle)
    if sensor.twice > 0.0:
        error += sensor.twice * math.sin(2.0 * angle + i)
    return length + error


@borrowing
def note_own(sensor: SensorArrays, lengths: FloatArray) -> None:
    """Keep what true ``lengths`` (6,) [m] are on the encoders' own scales, between the counts.

    What a foreign model takes in place of the counts has no zero within one.
    """
    half = -0.5 if sensor.floor else 0.0
    for i in range(6):
        sensor.own[i] = _on_scale(sensor, i, lengths[i])
        if sensor.address == 0:
            sensor.own[i] += (sensor.phase[i] + half) * sensor.resolution[i]


@borrowing
def count_lengths(sensor: SensorArrays, seed: int, sample: int, reading: FloatArray) -> None:
    """Turn true lengths into what the encoders read, in place, ``reading`` (6,) [m]."""
    half = 0.0 if sensor.floor else 0.5
    for i in range(6):
        length = _on_scale(sensor, i, reading[i])
        if sensor.noise[i] > 0.0:
            length += sensor.noise[i] * gaussian(seed, sample, i)
        count = sensor.resolution[i]
        if sensor.address != 0:
            memory = sensor.memory[i].ctypes.data
            length = call_sensor(sensor.address, length, i, sample, memory)
        elif count > 0.0:
            length = math.floor(length / count + sensor.phase[i] + half) * count
        reading[i] = length
