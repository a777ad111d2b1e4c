"""What nodes reported wrong, and whether that was in the run. No ROS here."""

from __future__ import annotations

from typing import NamedTuple

_ROUNDING = 1  # of a stamp to whole nanoseconds
_MOST = 100  # errors of a node that are kept until it is known when the run began


class Instant(NamedTuple):
    """When a sample was measured, by the wall clock and by the stage's [ns]."""

    wall: int
    stage: int


class Faults:
    """The first error of each node in a run, whose samples are ``sample_time`` [s] apart.

    Nodes stamp by the wall clock or, where they use simulated time, by the stage's: the latter goes
    in whole samples, which a wall clock does not hit to the nanosecond.
    """

    def __init__(self, sample_time: float) -> None:
        self._sample_time = sample_time
        self._begin: Instant | None = None
        self._reports: dict[str, list[tuple[int, str]]] = {}

    def add(self, stamp: int, node: str, message: str) -> None:
        """Take an error a node reported at a time [ns since the epoch]."""
        self._reports.setdefault(node, []).append((stamp, message))
        self._tidy(node)

    def begin(self, begin: Instant) -> None:
        """Forget what was before the run."""
        self._begin = begin
        for node in self._reports:
            self._tidy(node)

    def until(self, end: Instant | None) -> list[str]:
        """The errors up to the end of the run, None while it lasts."""
        return [
            f'{node}: {reports[0][1]}'
            for node, reports in sorted(self._reports.items())
            if reports and (end is None or self._after(reports[0][0], end) <= 0)
        ]

    def _tidy(self, node: str) -> None:
        reports = sorted(self._reports[node])
        if self._begin is None:
            self._reports[node] = reports[-_MOST:]
        else:
            begin = self._begin
            self._reports[node] = [one for one in reports if self._after(one[0], begin) >= 0][:1]

    def _after(self, stamp: int, instant: Instant) -> int:
        """How long after an instant a stamp is, by the clock that made it [ns]."""
        later = stamp - instant.stage
        return later if _whole(later, self._sample_time) else stamp - instant.wall


def _whole(duration: int, sample_time: float) -> bool:
    """Whether a duration [ns] is a whole number of samples."""
    step = sample_time * 1e9
    return abs(duration - round(round(duration / step) * step)) <= _ROUNDING
