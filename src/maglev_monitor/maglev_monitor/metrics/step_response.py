"""Step responses, measured while they happen. No ROS here."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, FloatArray
from maglev_monitor.metrics.derived import SOURCES
from maglev_monitor.metrics.run_parameters import RunParameters

_ROUNDING = 1e-12  # a whole count of error is within a bound of one count [m, rad]


class StepTracker:
    """One step from one set-point to another, on one or more axes.

    Positions come with an axis for their source, in the order of :data:`.derived.SOURCES`; NaN
    where there is none.

    :param start: set-point before the step, shape (5,).
    :param target: set-point of the step, shape (5,).
    :param first: sample number of the step's first sample.
    """

    def __init__(
        self, run: RunParameters, start: FloatArray, target: FloatArray, first: int
    ) -> None:
        settings, self._sample_time = run.metrics, run.sample_time
        self._start = start.copy()
        self._target = target.copy()
        self._bounds = np.array([settings.settling_bound, settings.encoder_bound]) + _ROUNDING
        self._direction = np.sign(target - start)
        self._first = first
        self._last = np.full(len(SOURCES), first - 1)
        self._beyond = np.zeros((len(SOURCES), 5))
        self._last_outside = np.full((2, len(SOURCES), 5), first - 1)  # bound, source, axis

    def add(self, sequence: NDArray[np.int64], position: FloatArray) -> None:
        """Take samples of the step in order: numbers, shape (n,), positions, (n, sources, 5)."""
        error = position - self._target
        beyond = np.fmax.reduce(error * self._direction, axis=0, initial=0.0)
        self._beyond = np.maximum(self._beyond, beyond)
        known = ~np.isnan(error[:, :, 0])
        for source in range(len(SOURCES)):
            if known[:, source].any():
                self._last[source] = sequence[known[:, source]][-1]
        magnitude = np.abs(error)
        unknown = np.isnan(magnitude) & known[:, :, None]  # a tilt that cannot be
        for index, bound in enumerate(self._bounds):
            outside = (magnitude > bound) | unknown
            row = len(outside) - 1 - outside[::-1].argmax(axis=0)
            latest = np.where(outside.any(axis=0), sequence[row], self._first - 1)
            self._last_outside[index] = np.maximum(self._last_outside[index], latest)

    def results(self, source: int) -> list[dict[str, Any]]:
        """What ``metrics.json`` says of the step, an entry for each axis that steps."""
        entries = []
        for axis in np.flatnonzero(self._direction):
            size = abs(self._target[axis] - self._start[axis])
            entries.append(
                {
                    'axis': AXES[axis],
                    'from': float(self._start[axis]),
                    'to': float(self._target[axis]),
                    'overshoot_percent': float(100.0 * self._beyond[source, axis] / size),
                    'settling_time': self._time_within(0, source, int(axis)),
                    'encoder_time': self._time_within(1, source, int(axis)),
                    'duration': int(self._last[source] + 1 - self._first) * self._sample_time,
                }
            )
        return entries

    def _time_within(self, bound: int, source: int, axis: int) -> float | None:
        """Time after which |e| stays within a bound ("go and stay below"), None if never."""
        outside = int(self._last_outside[bound, source, axis])
        if outside >= self._last[source]:
            return None
        return (outside + 1 - self._first) * self._sample_time
