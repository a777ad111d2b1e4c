"""What the reference does at a sample."""

from __future__ import annotations

import enum


class Phase(enum.IntEnum):
    """The values of ``phase`` in maglev_msgs/msg/Reference."""

    REST = 0  # on the lower stop, no current wanted
    LIFT_OFF = 1
    HOLD = 2  # at rest, or moving between set-points; not measured
    TRACK = 3  # measured: tracking errors count
    STEP = 4  # measured: step response towards the target counts
    LAND = 5
    END = 6  # landed, the run is over


def phase_name(number: int) -> str:
    """What a phase is called; the number itself where it is none of ours."""
    return Phase(number).name if number <= max(Phase) else str(number)
