"""The observer of position and rate, a sample at a time, and what it believes of counts.

A count is an interval: a reading says that the length lies within half a count of it, no more.
While the platen moves, counts follow one another, their errors average out, and the observer takes
a reading as it is. Where the reference rests nothing averages: a reading that falls back to the
middle of its count would make the integrator push until friction lets go, over and over. There the
observer mostly believes its prediction as long as that lies within the count that is read, and so
holds what it knew of the position when the last count was crossed.
"""

from __future__ import annotations

import math
from typing import Final

from maglev_controller.step.arrays import Reading, Record
from maglev_model.compiled import borrowing
from maglev_model.machine import Machine

DOUBT: Final = 0.7
"""Share of a difference within the count that is not believed at rest."""


@borrowing
def _believed(difference: float, half: float, doubt: float) -> float:
    """Reading less prediction, ``half`` a count, with what is not believed taken off."""
    return difference - doubt * min(max(difference, -half), half)


@borrowing
def surprises(settings: Record, machine: Machine, axes: Record, reading: Reading) -> None:
    """What the encoders read beyond what the observers predicted, by axis, into their records."""
    half, level = settings.half_gap, axes[0].estimated_position
    shift = half if settings.floored else 0.0
    tilt_phi = machine.r * math.sin(axes[3].estimated_position)
    tilt_theta = machine.r * math.sin(axes[4].estimated_position)
    doubt = settings.doubt * (1.0 - max(axes[0].awake, axes[3].awake, axes[4].awake))
    level -= shift
    one = _believed(reading.gap[0] - (level - tilt_phi), half, doubt)
    two = _believed(reading.gap[1] - (level + tilt_theta), half, doubt)
    three = _believed(reading.gap[2] - (level + tilt_phi), half, doubt)
    four = _believed(reading.gap[3] - (level - tilt_theta), half, doubt)
    axes[0].surprise = 0.25 * (one + two + three + four)
    axes[3].surprise = (three - one) / (2.0 * machine.r)
    axes[4].surprise = (two - four) / (2.0 * machine.r)
    half = settings.half_horizontal
    shift = half if settings.floored else 0.0
    for index, value in ((1, reading.x), (2, reading.z)):
        difference = value + shift - axes[index].estimated_position
        doubt = settings.doubt * (1.0 - axes[index].awake)
        axes[index].surprise = _believed(difference, half, doubt)


@borrowing
def observe(settings: Record, axis: Record, index: int) -> tuple[float, float]:
    """Position and velocity when w acts: the prediction, corrected by what surprises it."""
    axis.estimated_position += settings.observer_position[index] * axis.surprise
    axis.estimated_velocity += settings.observer_velocity[index] * axis.surprise
    position, velocity = axis.estimated_position, axis.estimated_velocity
    if settings.late:
        period, acceleration = settings.period, axis.pending_acceleration
        position += period * (velocity + 0.5 * period * acceleration)
        velocity += period * acceleration
    return position, velocity


@borrowing
def predict(settings: Record, axis: Record, realised: float) -> None:
    """Carry the estimate over to the next sample, its input known."""
    acceleration = realised
    if settings.learns:  # what is fed forward against other forces moves nothing
        acceleration -= axis.learned + axis.friction * axis.bristle
    if settings.late:
        acceleration, axis.pending_acceleration = axis.pending_acceleration, acceleration
    period = settings.period
    axis.estimated_position += period * (axis.estimated_velocity + 0.5 * period * acceleration)
    axis.estimated_velocity += period * acceleration
