"""Where the reference rests: the oscillators of the internal models fade, the integrator stays.

A platen at rest sticks, and steep friction answers an oscillator's frequency with a phase that no
gain serves in motion and at rest alike: the two would keep each other going. With nothing to follow
there is nothing for an oscillator to learn either, so it is let go, over a twentieth of a second.

An integrator that learns from readings makes their mean right, which it is where the platen stays
about the edge between two counts. Where one encoder tells of an axis and guides stick, it may learn
less from an error within the count, which may be none, than from one beyond it: then the platen is
read as the farther count for less of the time, and stays farther within the nearer one.
"""

from __future__ import annotations

from typing import Final

from maglev_controller.step.arrays import Record
from maglev_model.compiled import borrowing

CREEP: Final = 1e-5
"""A reference slower than this rests [m/s, rad/s]."""

REST: Final = 0.1
"""It may be as slow as that for this long before it counts as resting, as where it turns [s]."""

FADING_TIME: Final = 0.05
"""Time constant of letting go and of waking up [s]."""


@borrowing
def note_motion(settings: Record, axis: Record, position: float, velocity: float) -> None:
    """Move ``awake`` on; ``position`` and ``velocity`` of the reference at this sample.

    A reference without velocities moves as well.
    """
    speed = abs(position - axis.reference_position) / settings.period
    if max(speed, abs(velocity)) > CREEP:
        axis.rested = 0.0
    else:
        axis.rested += settings.period
    goal = 1.0 if axis.rested < REST else 0.0
    axis.awake += settings.waking * (goal - axis.awake)


@borrowing
def shares(settings: Record, axis: Record) -> tuple[float, float]:
    """Of the error, what oscillators learn from; of their states, what is kept."""
    if not settings.rest_fades:
        return 1.0, 1.0
    return axis.awake, 1.0 - settings.waking * (1.0 - axis.awake)


@borrowing
def error_to_learn(settings: Record, axis: Record, index: int, error: float) -> float:
    """What the internal model learns from in place of an error [m, rad]."""
    if abs(error) > settings.half_horizontal:
        return error
    return float(error * (1.0 - (1.0 - axis.awake) * (1.0 - settings.within_count[index])))
