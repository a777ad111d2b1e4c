"""Where the platen comes to rest, target by target, from below and from above. No ROS here."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, FloatArray
from maglev_monitor.metrics.derived import SOURCES
from maglev_monitor.metrics.repeatability import of_moments

_FROM, _TO = 0.4, 0.5  # after the reference came to rest: where a deviation is taken [s]
_STILL = 1e-12  # what a reference at rest may change by, for rounding [m, rad]
_PLACE = 1e-9  # what targets are told apart by [m, rad]
_LEAST = 2  # approaches from each side


@dataclasses.dataclass
class _Deviations:
    """Number, mean and sum of squares about it of the deviations (sources,) at a target."""

    count: int
    mean: FloatArray
    squares: FloatArray

    def add(self, deviation: FloatArray) -> None:
        """Take one more, by Welford's recurrence."""
        self.count += 1
        before = deviation - self.mean
        self.mean = self.mean + before / self.count
        self.squares = self.squares + before * (deviation - self.mean)


class _Axis:
    """The arrivals of one axis: ``found`` by target [nm, nrad] and direction."""

    def __init__(self, first: int, last: int) -> None:
        self._first, self._last = first, last  # samples after coming to rest
        self._place = np.nan
        self._moved = -1  # number of the sample that moved last
        self._upward = False
        self._sum: FloatArray = np.zeros(len(SOURCES))
        self.found: dict[tuple[int, bool], _Deviations] = {}

    def add(self, sequence: NDArray[np.int64], wanted: FloatArray, position: FloatArray) -> None:
        """Take samples without a gap: numbers and references (n,), positions (n, sources)."""
        change = np.diff(wanted, prepend=self._place)
        moves = ~(np.abs(change) <= _STILL)  # nor is it known whether the first of all moves
        begins = np.append(np.flatnonzero(moves), len(wanted))  # of motions and rests
        self._rest(sequence, wanted, position, 0, begins[0])
        for index in np.flatnonzero(np.diff(begins) > 1):
            self._come_to_rest(begins[index], sequence, change)
            self._rest(sequence, wanted, position, begins[index] + 1, begins[index + 1])
        if moves[-1]:
            self._come_to_rest(len(moves) - 1, sequence, change)
        self._place = wanted[-1]

    def _come_to_rest(self, row: int, sequence: NDArray[np.int64], change: FloatArray) -> None:
        known = np.isfinite(change[row])
        self._moved = int(sequence[row]) if known else -1
        self._upward = bool(change[row] > 0.0)
        self._sum = np.zeros(len(SOURCES))

    def forget(self) -> None:
        """What comes next does not follow what was."""
        self._place, self._moved = np.nan, -1

    def _rest(
        self,
        sequence: NDArray[np.int64],
        wanted: FloatArray,
        position: FloatArray,
        row: int,
        until: int,
    ) -> None:
        """Take samples from ``row`` to before ``until``, in which the reference rests."""
        if row >= until or self._moved < 0:
            return
        age = sequence[row:until] - self._moved
        inside = (age > self._first) & (age <= self._last)
        if not inside.any():
            return
        self._sum = self._sum + (position[row:until][inside] - wanted[row]).sum(axis=0)
        if age[inside][-1] == self._last:
            self._arrive(float(wanted[row]))

    def _arrive(self, target: float) -> None:
        key = round(target / _PLACE), self._upward
        zero = np.zeros(len(SOURCES))
        deviations = self.found.setdefault(key, _Deviations(0, zero, zero))
        deviations.add(self._sum / (self._last - self._first))


class Arrivals:
    """Deviations where the reference comes to rest, and what ISO 230-2 makes of them.

    A deviation is the mean of the error over 0.1 s, 0.4 s after the reference of that axis came to
    rest. Memory grows with the number of different targets only.
    """

    def __init__(self, sample_time: float) -> None:
        first, last = round(_FROM / sample_time), round(_TO / sample_time)
        self._axes = [_Axis(first, last) for _ in AXES]
        self._expected = -1

    def add(self, sequence: NDArray[np.int64], wanted: FloatArray, position: FloatArray) -> None:
        """Take measured samples in order: numbers (n,), references (n, 5), positions (n, s, 5)."""
        breaks = np.flatnonzero(np.diff(sequence, prepend=self._expected - 1) != 1)
        for part in np.split(np.arange(len(sequence)), breaks):
            if not len(part):
                continue
            if sequence[part[0]] != self._expected:
                for axis in self._axes:
                    axis.forget()
            for index, axis in enumerate(self._axes):
                axis.add(sequence[part], wanted[part, index], position[part, :, index])
            self._expected = int(sequence[part[-1]]) + 1

    def result(self) -> dict[str, dict[str, dict[str, Any]]]:
        """By source and axis; axes with no target met twice from each side are left out."""
        found: dict[str, dict[str, dict[str, Any]]] = {}
        for index, source in enumerate(SOURCES):
            for name, axis in zip(AXES, self._axes, strict=True):
                figures = _figures(axis, index)
                if figures is not None:
                    found.setdefault(source, {})[name] = figures
        return found


def _figures(axis: _Axis, source: int) -> dict[str, Any] | None:
    pairs = [
        (axis.found[target, True], axis.found[target, False])
        for target, upward in axis.found
        if upward and (target, False) in axis.found
    ]
    pairs = [pair for pair in pairs if min(one.count for one in pair) >= _LEAST]
    if not pairs:
        return None
    mean = np.array([[one.mean[source] for one in pair] for pair in pairs]).T
    squares = np.array([[one.squares[source] / (one.count - 1) for one in pair] for pair in pairs])
    if not np.all(np.isfinite(mean)):
        return None
    approaches = min(one.count for pair in pairs for one in pair)
    figures = of_moments(mean, np.sqrt(squares.T))
    return {**figures._asdict(), 'targets': len(pairs), 'approaches': approaches}
