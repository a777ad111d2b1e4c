"""Friction fed forward: its shape from the reference, its level learned in flight.

Guides resist motion with an acceleration that has nearly one size and turns with the direction.
Its shape goes by Dahl's model along the reference: after a reversal it turns over a short way, and
where the reference stops it stays. Its level is what w must make beyond the reference's
acceleration, in the direction of motion: the feedback makes up for whatever is missing of it, so a
regression of w on a constant and on that shape finds it without closing another loop. Learned is
only what acts while the platen follows its reference within the error that internal models learn
from.
"""

from __future__ import annotations

import math

from maglev_controller.step.arrays import Record
from maglev_model.compiled import borrowing


@borrowing
def friction_ahead(settings: Record, axis: Record, index: int) -> float:
    """What friction is going to take at this sample [m/s², rad/s²]; moves its shape on."""
    if settings.friction_gain == 0.0:
        return 0.0
    velocity = axis.smooth_velocity
    direction = math.copysign(1.0, velocity)
    if velocity != 0.0 and axis.bristle != direction:
        turned = -math.expm1(-abs(velocity) * settings.period / settings.friction_way[index])
        axis.bristle += turned * (direction - axis.bristle)
    return float(axis.friction * axis.bristle)


@borrowing
def learn_friction(settings: Record, axis: Record, index: int, realised: float) -> None:
    """Take what was ``realised`` of w at this sample into the level."""
    following = abs(axis.error) < settings.learned_error[index]
    if settings.friction_gain == 0.0 or axis.smooth_velocity == 0.0 or not following:
        return
    taken = realised - axis.wanted_acceleration
    missing = taken - axis.load - axis.friction * axis.bristle
    axis.load += settings.friction_gain * missing
    level = axis.friction + settings.friction_gain * missing * axis.bristle
    axis.friction = min(max(level, 0.0), settings.friction_limit[index])
