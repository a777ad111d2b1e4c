"""Samples that a topic lacks, and where, in bounded memory. No ROS here."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_MOST = 20  # holes of a topic that are kept with their place


class Holes:
    """The holes of one topic, in the order of their sample numbers."""

    def __init__(self) -> None:
        self.samples = 0
        self._count = 0
        self._places: list[tuple[int, int]] = []  # first and last sample of the first ones
        self._newest = (-2, -2)

    def add(self, missing: NDArray[np.int64]) -> None:
        """Take the numbers of missing samples, ascending, shape (n,)."""
        if len(missing):
            for part in np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1):
                self.add_range(int(part[0]), int(part[-1]))

    def add_range(self, first: int, last: int) -> None:
        """Take missing samples from one number to another; none where that is before the first."""
        if last < first:
            return
        self.samples += last - first + 1
        if first == self._newest[1] + 1:
            first = self._newest[0]
            del self._places[self._count - 1 :]
        else:
            self._count += 1
        self._newest = (first, last)
        if self._count <= _MOST:
            self._places.append(self._newest)

    def drop_from(self, number: int) -> None:
        """Forget a last hole that begins at this sample: nothing was to come any more."""
        first, last = self._newest
        if self._count and first == number:
            self.samples -= last - first + 1
            del self._places[self._count - 1 :]
            self._count -= 1

    def result(self) -> dict[str, Any]:
        """How many holes there are, and the first and last samples of the first ones."""
        return {'count': self._count, 'samples': [list(place) for place in self._places]}
