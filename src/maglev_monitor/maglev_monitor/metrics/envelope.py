"""Time series in bounded memory: least, greatest and first value of each bin. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray


class Envelope:
    """Columns over sample numbers; when the bins are full, neighbours merge and bins are twice as
    wide.

    :param columns: number of columns.
    :param bins: number of bins, even.
    """

    def __init__(self, columns: int, bins: int = 3000) -> None:
        self._low = np.full((bins, columns), np.nan)
        self._high = np.full((bins, columns), np.nan)
        self._first = np.full((bins, columns), np.nan)
        self._start: int | None = None
        self._used = 0
        self.width = 1
        """Samples in a bin."""

    def add(self, sequence: NDArray[np.int64], values: FloatArray) -> None:
        """Take rows in order: sample numbers, shape (n,), values, shape (n, columns), or NaN."""
        if not len(sequence):
            return
        if self._start is None:
            self._start = int(sequence[0])
        while (int(sequence[-1]) - self._start) // self.width >= len(self._low):
            self._merge()
        bins = (sequence - self._start) // self.width
        starts = np.flatnonzero(np.diff(bins, prepend=-1))
        touched = bins[starts]
        self._low[touched] = np.fmin(self._low[touched], np.fmin.reduceat(values, starts))
        self._high[touched] = np.fmax(self._high[touched], np.fmax.reduceat(values, starts))
        first = self._first[touched]
        self._first[touched] = np.where(np.isnan(first), values[starts], first)
        self._used = int(touched[-1]) + 1

    @property
    def sequence(self) -> NDArray[np.int64]:
        """Sample number at the start of each bin that is used, shape (m,)."""
        return (self._start or 0) + self.width * np.arange(self._used)

    @property
    def low(self) -> FloatArray:
        """Least values, shape (m, columns), NaN where there are none."""
        return self._low[: self._used]

    @property
    def high(self) -> FloatArray:
        """Greatest values, shape (m, columns), NaN where there are none."""
        return self._high[: self._used]

    @property
    def first(self) -> FloatArray:
        """First values, shape (m, columns), NaN where there are none."""
        return self._first[: self._used]

    def _merge(self) -> None:
        half = len(self._low) // 2
        for values, fold in ((self._low, np.fmin), (self._high, np.fmax), (self._first, _earlier)):
            values[:half] = fold(values[0::2], values[1::2])
            values[half:] = np.nan
        self.width *= 2
        self._used = (self._used + 1) // 2


def _earlier(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.where(np.isnan(first), second, first)
