"""What nodes reported wrong, and whether that was before the run's end. No ROS here."""

from __future__ import annotations

from typing import NamedTuple

_ROUNDING = 1  # of a stamp to whole nanoseconds


class Instant(NamedTuple):
    """When a sample was measured, by the wall clock and by the stage's [ns]."""

    wall: int
    stage: int


class Faults:
    """The first error of each node."""

    def __init__(self) -> None:
        self._first: dict[str, tuple[int, str]] = {}

    def add(self, stamp: int, node: str, message: str) -> None:
        """Take an error a node reported at a time [ns since the epoch]; its first counts."""
        known = self._first.get(node)
        if known is None or stamp < known[0]:
            self._first[node] = (stamp, message)

    def until(self, end: Instant | None, sample_time: float) -> list[str]:
        """The errors up to the end of the run, None while it lasts.

        Nodes stamp by the wall clock or, where they use simulated time, by the stage's: the latter
        goes in whole samples of ``sample_time`` [s], which a wall clock does not hit to the
        nanosecond.
        """
        return [
            f'{node}: {message}'
            for node, (stamp, message) in sorted(self._first.items())
            if end is None
            or stamp <= (end.stage if _whole(end.stage - stamp, sample_time) else end.wall)
        ]


def _whole(duration: int, sample_time: float) -> bool:
    """Whether a duration [ns] is a whole number of samples."""
    step = sample_time * 1e9
    return abs(duration - round(round(duration / step) * step)) <= _ROUNDING
