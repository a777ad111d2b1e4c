"""The curves of a run, gathered from its blocks in bounded memory. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray
from maglev_model.contract.phases import Phase
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.derived import SOURCES, phase_currents, positions
from maglev_monitor.metrics.envelope import Envelope
from maglev_monitor.metrics.run_parameters import RunParameters

COLUMNS = {
    'reference': slice(0, 5),
    'true': slice(5, 10),
    'measured': slice(10, 15),
    'true_error': slice(15, 20),
    'measured_error': slice(20, 25),
    'direct_current': slice(25, 29),
    'quadrature_current': slice(29, 33),
    'phase_current': slice(33, 37),
    'thermal_load': slice(37, 41),
    'tick': slice(41, 42),
    'phase': slice(42, 43),
    'saturated': slice(43, 44),
}
"""Columns of a run's curves. Errors are against the target in a STEP, against the reference
otherwise; ``phase_current`` is the largest magnitude among a motor's three phases [A], ``tick`` the
wall-clock time since the sample before [s]."""

_DRAWN = ('true', 'measured')
_TAIL = 3.0  # of tracking whose samples are kept one by one [s]
_MOST_STEPS = 40
_STEP_BINS = 1200


class StepCurves(Envelope):
    """The curves of one step, with where it started and what it aimed at."""

    def __init__(self, start: FloatArray, target: FloatArray) -> None:
        super().__init__(_width(), _STEP_BINS)
        self.start = start
        self.target = target


class RunCurves:
    """Takes the rows that :meth:`.RunMetrics.add` returns, in order.

    ``whole_run`` is all of it, ``steps`` each step, ``tail`` the last tracking samples one by one:
    sample numbers, shape (n,), and columns, shape (n, :data:`COLUMNS`).
    """

    def __init__(self, run: RunParameters) -> None:
        self.whole_run = Envelope(_width())
        self.steps: list[StepCurves] = []
        self.begun: int | None = None
        """When the first sample was measured, by the wall clock since the epoch [ns]."""
        self._machine = run.machine
        self._tail = round(_TAIL / run.sample_time)  # [samples]
        self._tail_parts: list[tuple[NDArray[np.int64], FloatArray]] = []
        self._segment: int | None = None
        self._target: FloatArray | None = None
        self._step: StepCurves | None = None
        self._previous = (-1, 0)  # sequence and stamp of the last measurement

    def add(self, rows: Records) -> None:
        """Take the next rows of the run."""
        if not len(rows):
            return
        values = self._values(rows)
        self.whole_run.add(rows['sequence'], values)
        self._add_tail(rows, values)
        known = np.flatnonzero(rows['has_reference'])
        changes = np.flatnonzero(np.diff(rows['segment'][known])) + 1
        for part in np.split(known, changes):
            if len(part):
                self._add_segment(rows[part], values[part])

    @property
    def tail(self) -> tuple[NDArray[np.int64], FloatArray]:
        """The last tracking samples, one by one."""
        if not self._tail_parts:
            return np.zeros(0, np.int64), np.zeros((0, _width()))
        sequence = np.concatenate([part[0] for part in self._tail_parts])
        values = np.concatenate([part[1] for part in self._tail_parts])
        return sequence[-self._tail :], values[-self._tail :]

    def _values(self, rows: Records) -> FloatArray:
        values = np.full((len(rows), _width()), np.nan)
        referenced = rows['has_reference']
        values[referenced, COLUMNS['reference']] = rows['reference'][referenced]
        values[referenced, COLUMNS['phase']] = rows['phase'][referenced][:, None]
        wanted = np.where((rows['phase'] == Phase.STEP)[:, None], rows['target'], rows['reference'])
        wanted[~referenced] = np.nan
        position = positions(rows, self._machine.radius)
        for source in _DRAWN:
            found = position[:, SOURCES.index(source)]
            values[:, COLUMNS[source]] = found
            values[:, COLUMNS[f'{source}_error']] = found - wanted
        driven = rows['has_currents']
        for name in ('direct_current', 'quadrature_current'):
            values[driven, COLUMNS[name]] = rows[name][driven]
        measured = rows['has_measurement']
        both = driven & measured
        currents = np.abs(phase_currents(rows[both], self._machine.pole_pitch)).max(axis=2)
        values[both, COLUMNS['phase_current']] = currents
        plant = rows['has_plant']
        values[plant, COLUMNS['thermal_load']] = rows['thermal_load'][plant]
        controlled = rows['has_controller']
        values[controlled, COLUMNS['saturated']] = rows['saturated'][controlled][:, None]
        values[measured, COLUMNS['tick']] = self._ticks(rows[measured])[:, None]
        return values

    def _ticks(self, rows: Records) -> FloatArray:
        if not len(rows):
            return np.zeros(0)
        if self.begun is None:
            self.begun = int(rows['stamp'][0])
        sequence = np.concatenate([[self._previous[0]], rows['sequence']])
        stamp = np.concatenate([[self._previous[1]], rows['stamp']])
        self._previous = (int(sequence[-1]), int(stamp[-1]))
        ticks: FloatArray = np.where(np.diff(sequence) == 1, np.diff(stamp) * 1e-9, np.nan)
        return ticks

    def _add_tail(self, rows: Records, values: FloatArray) -> None:
        tracked = rows['has_reference'] & (rows['phase'] == Phase.TRACK)
        if tracked.any():
            self._tail_parts.append((rows['sequence'][tracked], values[tracked]))
            while sum(len(part[0]) for part in self._tail_parts[1:]) >= self._tail:
                del self._tail_parts[0]

    def _add_segment(self, rows: Records, values: FloatArray) -> None:
        segment = int(rows['segment'][0])
        if segment != self._segment:
            start, target = self._target, np.array(rows['target'][0])
            self._segment, self._target, self._step = segment, target, None
            steps = rows['phase'][0] == Phase.STEP and len(self.steps) < _MOST_STEPS
            if steps and start is not None:
                self._step = StepCurves(start, target)
                self.steps.append(self._step)
        if self._step is not None:
            self._step.add(rows['sequence'], values)


def _width() -> int:
    return int(max(columns.stop for columns in COLUMNS.values()))
