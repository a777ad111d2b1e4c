"""The last seconds of some columns, each bin by its least and greatest value. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray

_NONE = np.iinfo(np.int64).min


class History:
    """A window that moves with the newest sample: no peak is lost, however few bins there are.

    :param columns: number of columns.
    :param bins: number of bins in the window.
    :param width: samples in a bin.
    """

    def __init__(self, columns: int, bins: int, width: int) -> None:
        self._low = np.full((bins, columns), np.nan)
        self._high = np.full((bins, columns), np.nan)
        self._number = np.full(bins, _NONE, np.int64)  # of the bin that each row holds
        self._newest = -1
        self._width = width

    def add(self, sequence: NDArray[np.int64], values: FloatArray) -> None:
        """Take rows in order: sample numbers, shape (n,), values, shape (n, columns).

        A stage that counts from the beginning again begins the window anew.
        """
        if not len(sequence):
            return
        bins = sequence // self._width
        if bins[-1] < self._newest:
            self._number[:] = _NONE
        shown = bins > bins[-1] - len(self._number)
        bins, values = bins[shown], values[shown]
        starts = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
        rows, numbers = bins[starts] % len(self._number), bins[starts]
        fresh = rows[self._number[rows] != numbers]
        self._low[fresh] = self._high[fresh] = np.nan
        low, high = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
        for row, number, least, greatest in zip(rows, numbers, low, high, strict=True):
            self._low[row] = np.fmin(self._low[row], least)
            self._high[row] = np.fmax(self._high[row], greatest)
            self._number[row] = number
        self._newest = int(bins[-1])

    def curves(self) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Sample numbers of the bins' starts, (bins,), least and greatest values, (bins, columns).

        From the oldest to the newest; NaN where there are none.
        """
        count = len(self._number)
        numbers = np.arange(self._newest - count + 1, self._newest + 1)
        rows = numbers % count
        missing = self._number[rows] != numbers
        low, high = self._low[rows], self._high[rows]
        low[missing] = high[missing] = np.nan
        return numbers * self._width, low, high
