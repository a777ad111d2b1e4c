"""What a run shows while it lasts. No ROS here."""

from __future__ import annotations

import math

import numpy as np

from maglev_model.axes import AXES
from maglev_model.contract.phases import phase_name
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.derived import positions
from maglev_monitor.metrics.run_parameters import RunParameters


class Progress:
    """Stage time, real-time factor, phase and mean |e| of the newest block."""

    def __init__(self, run: RunParameters) -> None:
        self._sample_time, self._radius = run.sample_time, run.machine.radius
        self._latest: Records | None = None
        self._before: tuple[int, float] | None = None
        self._values: dict[str, object] = {}

    def add(self, rows: Records) -> None:
        """Take the rows of the run that came last."""
        if len(rows):
            self._latest = rows

    def values(self) -> dict[str, object]:
        """What the last line said, by name."""
        return dict(self._values)

    def line(self, sequence: int, phase: int, now: float) -> str:
        """One line of progress.

        :param sequence: newest sample of the stage.
        :param phase: phase of the newest block of the run.
        :param now: time on a steady clock [s].
        """
        stage_time = max(sequence, 0) * self._sample_time
        before, self._before = self._before, (sequence, now)
        factor = 0.0
        if before is not None and now > before[1]:
            factor = (sequence - before[0]) * self._sample_time / (now - before[1])
        name, errors = phase_name(phase), self._errors()
        self._values = {
            'stage_time': f'{stage_time:.3f}',
            'real_time_factor': f'{factor:.2f}',
            'phase': name,
            **{f'mean_abs_error.{axis}': f'{e:.3e}' for axis, e in zip(AXES, errors, strict=True)},
        }
        micro = '  '.join(
            f'{axis} –' if math.isnan(error) else f'{axis} {1e6 * error:.1f}'
            for axis, error in zip(AXES, errors, strict=True)
        )
        return f't {stage_time:8.2f} s  {factor:5.2f} x  {name:<8}  |e| [µm, µrad]  {micro}'

    def _errors(self) -> list[float]:
        """Mean |e| by axis, of the true position if the plant gives it [m, rad]."""
        if self._latest is None:
            return [float('nan')] * len(AXES)
        rows = self._latest[self._latest['has_reference']]
        error = np.abs(positions(rows, self._radius) - rows['reference'][:, None, :])
        source = 0 if rows['has_plant'].any() else 1
        known = error[~np.isnan(error[:, source, 0]), source]
        if not len(known):
            return [float('nan')] * len(AXES)
        means: list[float] = known.mean(axis=0).tolist()
        return means
