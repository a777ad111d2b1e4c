"""When samples are taken in real time: by the stage's own clock, or by absolute deadlines.

A tick takes a first sample, further ones while ``again`` says so, and then waits. Samples are
given by their sequence numbers, times are in s.
"""

from __future__ import annotations

import time
from collections.abc import Callable

_EARLY = 0.7
"""Share of a sample time after which the node waits in the stage for its clock."""

_SHORTEST_WAIT = 5e-5  # [s]

_CATCH_UP = 20  # samples in one tick, at most


class StageClock:
    """For a stage that waits for a clock of its own when it is read.

    A tick comes a little before the stage's, so that the graph is served until then. ``period`` is
    from one tick to the next, unless :meth:`wait` says otherwise.
    """

    def __init__(self, sample_time: float) -> None:
        self._sample_time = sample_time
        self.period = _EARLY * sample_time

    def start(self, sequence: int) -> None:
        """The first sample has been taken now: nothing to remember."""

    def behind(self, sequence: int) -> float:
        """How far that newest sample is behind the clock as a tick begins: only the stage knows."""
        return 0.0

    def again(self, sequence: int, taken: int, late: float) -> bool:
        """Whether a tick that has ``taken`` samples, the newest ``late``, takes another.

        While that one waits already.
        """
        return taken < _CATCH_UP and late >= self._sample_time

    def wait(self, passed: float) -> float:
        """How long until the next tick, when so long has passed since the newest sample was due.

        Until a little before the next one.
        """
        return max(self.period - passed, _SHORTEST_WAIT)


class Deadlines:
    """For a stage without a clock: a sample every sample time since the first.

    Held up, it catches up two samples at a time: in a longer burst no answer could reach it, and
    its own delay would look like the controller's.
    """

    def __init__(self, sample_time: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.period = sample_time
        self._clock = clock
        self._first_tick, self._first_sequence = clock(), 0
        self._due = 0

    def start(self, sequence: int) -> None:
        """Count deadlines from now and this sample on."""
        self._first_tick, self._first_sequence = self._clock(), sequence

    def behind(self, sequence: int) -> float:
        """By the samples that are due."""
        elapsed = self._clock() - self._first_tick
        self._due = self._first_sequence + int(elapsed / self.period)
        return (self._due - sequence) * self.period

    def again(self, sequence: int, taken: int, late: float) -> bool:
        """A second one, when that is due too."""
        return taken < 2 and self._due > sequence

    def wait(self, passed: float) -> None:
        """The timer's period is right as it is."""


Pace = StageClock | Deadlines
