"""Where the reference rests: the oscillators of the internal models fade, the integrator stays.

A platen at rest sticks, and steep friction answers an oscillator's frequency with a phase that no
gain serves in motion and at rest alike: the two would keep each other going. With nothing to follow
there is nothing for an oscillator to learn either, so it is let go, over a twentieth of a second.

An integrator that learns from readings makes their mean right, which it is where the platen stays
about the edge between two counts. Where one encoder tells of an axis and guides stick, it may learn
less from an error within the count, which may be none, than from one beyond it: then the platen is
read as the farther count for less of the time, and stays farther within the nearer one.

Then an edge, when the platen comes back over it, also tells how far it still has to go, which no
reading tells on the way. Guides that give like springs want a force that is shifted in proportion,
so the integrator learns from that way for a while. Guides that hold until they let go stop the
platen as soon as w gives way, which the reading's leap makes it do: where it has stood before, w
goes on as it is for as long as it slides that way, on an axis that is told how fast that is. Guides
that creep let it drift over the other edge soon after, and each time that happens less is learned,
down to nothing.
"""

from __future__ import annotations

import math
from typing import Final

from maglev_controller.step.arrays import Record
from maglev_model.compiled import borrowing

CREEP: Final = 1e-5
"""A reference slower than this rests [m/s, rad/s]."""

REST: Final = 0.1
"""It may be as slow as that for this long before it counts as resting, as where it turns [s]."""

FADING_TIME: Final = 0.05
"""Time constant of letting go and of waking up [s]."""

PUSH_TIME: Final = 0.02
"""For so long it learns from the way that is left when the platen comes back over an edge [s]."""

STOOD: Final = 0.03
"""A reading as old as that when the platen comes back is of one that stuck [s]."""

APART: Final = 0.1
"""What comes back sooner again is the same coming back, of a reading that flickers [s]."""

SOON: Final = 0.5
"""Within it the other edge is crossed because it was pushed too far [s]."""

WEAKER: Final = 0.25
"""Share of the way that is learned from after each time it was pushed too far."""


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
    share = settings.within_count[index]
    if share == 1.0:
        return error
    pushed = _pushed(settings, axis, settings.slide_speed[index], error)
    if abs(error) > settings.half_horizontal:
        return error
    return float(error * (1.0 - (1.0 - axis.awake) * (1.0 - share)) + pushed)


@borrowing
def _pushed(settings: Record, axis: Record, slides: float, error: float) -> float:
    """What is learned from besides [m], after an edge that was crossed; takes note of the error."""
    half, before, stood = settings.half_horizontal, axis.last_read, axis.stood
    axis.last_read = error
    axis.stood = 0.0 if abs(error - before) > half else stood + settings.period
    axis.returned += settings.period
    if axis.awake > 0.5:
        axis.too_far, axis.edge, axis.push_left = 0, 0.0, 0.0
    if abs(error) > half:
        if abs(error) > 3.0 * half:
            axis.goes_on = 0.0
        return 0.0
    if half < abs(before) < 3.0 * half and axis.awake < 0.5 and axis.returned > APART:
        _come_back(axis, math.copysign(min(abs(before) - half, half), before), stood, slides)
    if axis.push_left <= 0.0:
        return 0.0
    axis.push_left -= settings.period
    return float(WEAKER**axis.too_far * axis.way)


@borrowing
def _come_back(axis: Record, way: float, stood: float, slides: float) -> None:
    """The platen is back over an edge, from where it has ``stood`` [s], on its ``way`` [m].

    That is how far it has to go, at most to the middle of the count, with the sign of its error.
    ``slides`` is the speed of one that has broken loose, 0 where it is not known [m/s].
    """
    edge = math.copysign(1.0, way)
    if edge == -axis.edge and axis.returned < SOON:
        axis.too_far += 1
    axis.edge, axis.returned, axis.way, axis.push_left = edge, 0.0, way, PUSH_TIME
    if slides > 0.0 and stood > STOOD:
        axis.goes_on = WEAKER**axis.too_far * abs(way) / slides
