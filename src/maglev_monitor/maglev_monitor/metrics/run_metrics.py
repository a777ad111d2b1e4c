"""The figures of a run, computed while it lasts or from its bag: same blocks, same code, same bits.

A run lasts from the first sample whose reference leaves REST to the first one of END; what is
outside does not count. Memory does not grow with its length (but for one small record for each
step). No ROS here.
"""

from __future__ import annotations

import copy
import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import TOPIC_TYPES
from maglev_monitor.metrics.arrivals import Arrivals
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.derived import SOURCES, phase_currents, positions
from maglev_monitor.metrics.faults import Faults, Instant
from maglev_monitor.metrics.following import Following
from maglev_monitor.metrics.further import Further
from maglev_monitor.metrics.holes import Holes
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_monitor.metrics.step_response import StepTracker
from maglev_monitor.metrics.verdict import verdict

LIMITS = {'current': 1, 'levitation': 2}
"""What limits currents, as bits of ControllerState's ``limited_by``."""

_TRUE, _MEASURED, _OWN = (SOURCES.index(source) for source in ('true', 'measured', 'own'))
_OPTIONAL = ('controller', 'plant')  # a stage or controller may do without
_TICK_RESOLUTION = 1e-6  # of the tick histogram [s]
_TICK_BINS = 200_000
_RUNNING = (Phase.LIFT_OFF, Phase.HOLD, Phase.TRACK, Phase.STEP, Phase.LAND)


class RunMetrics:
    """Takes the blocks of :class:`maglev_monitor.metrics.joiner.Joiner` and yields the figures."""

    def __init__(self, run: RunParameters) -> None:
        self._run = run
        self.started = self._whole = False  # from its lift-off on
        self.ended = False
        self.phase: int = Phase.REST
        self._expected = -1
        self._run_rows = 0
        self._seen = dict.fromkeys(TOPIC_TYPES, 0)
        self._holes = {key: Holes() for key in TOPIC_TYPES}
        self._last = dict.fromkeys(TOPIC_TYPES, -1)  # number of the last sample with one
        self._tracking = _Tracking()
        self._arrivals = Arrivals(run.sample_time)
        self._has_own = False  # whether the stage tells what its encoders' own scales have
        self._measured_samples = 0
        self._steps: list[StepTracker] = []
        self._segment: int | None = None
        self._target: FloatArray | None = None
        self._step: StepTracker | None = None
        self._currents = _Currents(run.machine.pole_pitch)
        self._further = Further(run)
        self._timing = _Timing()
        self._following = Following()
        self._faults = Faults(run.sample_time)
        self._end: Instant | None = None

    @property
    def failed(self) -> bool:
        """Whether a node has reported an error in the run."""
        return self.started and bool(self._faults.until(self._end))

    @property
    def tick_histogram(self) -> NDArray[np.int64]:
        """Numbers of ticks in bins of 1 µs from 0 on; the last bin holds what is longer."""
        return self._timing.histogram

    def add(self, block: Records) -> Records:
        """Take one block and return the rows of it that belong to the run.

        Blocks come in order of their sample numbers; one that is left out counts as missing.
        """
        if self.ended:
            return block[:0]
        phases = self._phases(block)
        first, last = 0, len(block)
        if not self.started:
            moving = np.flatnonzero(np.isin(phases, _RUNNING))
            if not len(moving):
                return block[:0]
            self.started = True
            first = int(moving[0])
            self._whole = bool(phases[first] == Phase.LIFT_OFF)
        else:
            self._skip(int(block['sequence'][0]))
        ends = np.flatnonzero(phases[first:] == Phase.END)
        if len(ends):
            self.ended = True
            last = first + int(ends[0])
        rows = block[first:last]
        following = slice(first, last + 1)  # with the sample that ends it
        self._following.add(block[following], phases[following])
        if len(rows):
            self._add_rows(rows, phases[first:last])
        if self.ended:
            at_end = _instant(block[last])
            self._end = at_end if at_end.wall else self._timing.latest
        self._expected = int(block['sequence'][-1]) + 1
        return rows

    def add_fault(self, stamp: int, node: str, message: str) -> None:
        """Take an error a node reported at a time [ns since the epoch]; the run's first counts."""
        self._faults.add(stamp, node, message)

    def result(self, *, cut_off: bool = False) -> dict[str, Any]:
        """The content of ``metrics.json``; complete only from lift-off to the end of the run.

        :param cut_off: whether what was still to come may have been written no more.
        """
        run, source = self._run, _TRUE if self._seen['plant'] else _MEASURED
        sample_time = run.sample_time
        figures: dict[str, Any] = {
            'scenario': run.scenario,
            'stage': run.stage,
            'mode': run.mode,
            'duration': self._measured_samples * sample_time,
            'samples': self._measured_samples,
            'run_samples': self._run_rows,
            **self._missing_result(cut_off),
            'error_source': SOURCES[source],
            'axes': self._tracking.result(source),
            'measured_axes': self._tracking.result(_MEASURED),
            'own_axes': self._tracking.result(_OWN) if self._has_own else None,
            'steps': self._step_results(source),
            'own_steps': self._step_results(_OWN) if self._has_own else None,
            'repeatability': self._arrivals.result(),
            'currents': self._currents.result(),
            'timing': self._timing.result(sample_time),
            'faults': self._faults.until(self._end),
            'left': self._following.left,
        }
        if run.metrics.modules:
            figures['further'] = self._further.result()
            figures['further_failed'] = self._further.failed
        return {**figures, **verdict(figures, run, whole=self._whole, ended=self.ended)}

    def _step_results(self, source: int) -> list[dict[str, Any]]:
        return [entry for step in self._steps for entry in step.results(source)]

    def _missing_result(self, cut_off: bool) -> dict[str, Any]:
        """By topic; a landing after a reference that was ended is no loss of the reference."""
        holes = copy.deepcopy(self._holes)
        for key in () if self.ended else TOPIC_TYPES if cut_off else ('reference',):
            if self._seen[key]:
                holes[key].drop_from(self._last[key] + 1)
        by_topic = {
            key: found for key, found in holes.items() if self._seen[key] or key not in _OPTIONAL
        }
        return {
            'missing_samples': sum(found.samples for found in by_topic.values()),
            'missing_by_topic': {key: found.samples for key, found in by_topic.items()},
            'holes': {key: found.result() for key, found in by_topic.items() if found.samples},
        }

    def _phases(self, block: Records) -> NDArray[np.uint8]:
        """Phases of the rows; a row without reference has that of the row before it."""
        known = np.where(block['has_reference'], np.arange(len(block)), -1)
        known = np.maximum.accumulate(known)
        phases: NDArray[np.uint8] = np.where(known >= 0, block['phase'][known], self.phase)
        self.phase = int(phases[-1])
        return phases

    def _skip(self, sequence: int) -> None:
        self._run_rows += sequence - self._expected
        for holes in self._holes.values():
            holes.add_range(self._expected, sequence - 1)

    def _add_rows(self, rows: Records, phases: NDArray[np.uint8]) -> None:
        self._run_rows += len(rows)
        for key in TOPIC_TYPES:
            present = rows[f'has_{key}']
            if present.any():
                self._last[key] = int(rows['sequence'][present][-1])
            self._seen[key] += int(np.count_nonzero(present))
            self._holes[key].add(rows['sequence'][~present])
        position = positions(rows, self._run.machine.radius)
        self._has_own = self._has_own or bool(np.isfinite(rows['own_length']).any())
        referenced = rows['has_reference']
        measured = referenced & np.isin(phases, (Phase.TRACK, Phase.STEP))
        self._measured_samples += int(np.count_nonzero(measured))
        tracked = referenced & (phases == Phase.TRACK)
        self._tracking.add(position[tracked] - rows['reference'][tracked][:, None, :])
        self._arrivals.add(
            rows['sequence'][measured], rows['reference'][measured], position[measured]
        )
        self._add_segments(rows[referenced], position[referenced])
        self._further.add(rows, position)
        self._currents.add(rows)
        timed = rows[rows['has_measurement']]
        if len(timed):
            if self._timing.latest is None:
                self._faults.begin(_instant(timed[0]))
            self._timing.add(timed)

    def _add_segments(self, rows: Records, position: FloatArray) -> None:
        """Follow the set-points and feed the steps between them."""
        changes = np.flatnonzero(np.diff(rows['segment'])) + 1
        bounds = [0, *changes.tolist(), len(rows)]
        for first, last in itertools.pairwise(bounds):
            if first == last:
                continue
            part = rows[first:last]
            if int(part['segment'][0]) != self._segment:
                self._enter_segment(part[0])
            if self._step is not None:
                self._step.add(part['sequence'], position[first:last])

    def _enter_segment(self, row: np.void) -> None:
        """A step whose start is not known, since it began before the recording, is left out."""
        start, target = self._target, np.array(row['target'])
        self._segment = int(row['segment'])
        self._target = target
        self._step = None
        if row['phase'] == Phase.STEP and start is not None and (target != start).any():
            self._step = StepTracker(self._run, start, target, int(row['sequence']))
            self._steps.append(self._step)


def _instant(row: np.void) -> Instant:
    return Instant(int(row['stamp']), int(row['stage_time']))


class _Tracking:
    """Mean, rms and largest |e|, and the mean of e, by source and axis."""

    def __init__(self) -> None:
        self._count = np.zeros(len(SOURCES), np.int64)
        self._sum = np.zeros((len(SOURCES), 5))
        self._signed = np.zeros((len(SOURCES), 5))
        self._squares = np.zeros((len(SOURCES), 5))
        self._max = np.zeros((len(SOURCES), 5))

    def add(self, error: FloatArray) -> None:
        """Take errors (n, sources, 5), NaN where unknown [m, rad]."""
        for source in range(len(SOURCES)):
            known = error[~np.isnan(error[:, source, 0]), source]
            if not len(known):
                continue
            magnitude = np.abs(known)
            self._count[source] += len(known)
            self._sum[source] += magnitude.sum(axis=0)
            self._signed[source] += known.sum(axis=0)
            self._squares[source] += np.square(known).sum(axis=0)
            self._max[source] = np.maximum(self._max[source], magnitude.max(axis=0))

    def result(self, source: int) -> dict[str, dict[str, float | None]]:
        known = self._count[source] > 0
        count = max(int(self._count[source]), 1)
        figures = {
            'mean_abs_error': self._sum[source] / count,
            'rms_error': np.sqrt(self._squares[source] / count),
            'max_abs_error': self._max[source],
            'bias': self._signed[source] / count,
        }
        return {  # NaN where a tilt could not be made out
            axis: {
                name: float(values[index]) if known and not np.isnan(values[index]) else None
                for name, values in figures.items()
            }
            for index, axis in enumerate(AXES)
        }


class _Currents:
    """Peak phase current, rms of the current vector, saturation and thermal load."""

    def __init__(self, pole_pitch: float) -> None:
        self._pole_pitch = pole_pitch
        self._count = 0
        self._squares = np.zeros(4)
        self._peak = 0.0
        self._not_finite = 0
        self._saturated = 0
        self._saturated_by = dict.fromkeys(LIMITS, 0)
        self._thermal_load = 0.0

    def add(self, rows: Records) -> None:
        driven = rows[rows['has_currents'] & rows['has_measurement']]
        squares = np.square(driven['direct_current']) + np.square(driven['quadrature_current'])
        known = np.isfinite(squares).all(axis=1)
        self._not_finite += int(np.count_nonzero(~known))
        self._saturated += int(np.count_nonzero(rows['saturated']))
        for limit, bit in LIMITS.items():
            self._saturated_by[limit] += int(np.count_nonzero(rows['limited_by'] & bit))
        self._thermal_load = float(max(self._thermal_load, rows['thermal_load'].max()))
        if not known.any():
            return
        self._count += int(np.count_nonzero(known))
        self._squares += squares[known].sum(axis=0)
        phases = np.abs(phase_currents(driven[known], self._pole_pitch))
        self._peak = max(self._peak, float(phases.max()))

    def result(self) -> dict[str, Any]:
        """``rms`` is of the vector (i_d, i_q), hence sqrt(2) times that of a phase [A].

        Samples whose currents are no finite numbers are counted, and left out of all else.
        """
        return {
            'peak_phase': self._peak,
            'rms': np.sqrt(self._squares / max(self._count, 1)).tolist(),
            'not_finite_samples': self._not_finite,
            'saturated_samples': self._saturated,
            'saturated_by': dict(self._saturated_by),
            'peak_thermal_load': self._thermal_load,
        }


class _Timing:
    """Wall-clock time from sample to sample, as the stage gives it with its measurements."""

    def __init__(self) -> None:
        self.histogram = np.zeros(_TICK_BINS, np.int64)
        self._longest = 0
        self._periods: set[int] = set()  # the least and the greatest of stage time [ns]
        self._first: Records | None = None  # measured sample, (1,)
        self._last: Records | None = None

    @property
    def latest(self) -> Instant | None:
        """When the last sample was measured."""
        return None if self._last is None else _instant(self._last[0])

    def add(self, rows: Records) -> None:
        """Take measured samples, at least one."""
        if self._first is None:
            self._first = rows[:1].copy()
        before = rows[:0] if self._last is None else self._last
        steps, walls, stages = (
            np.diff(np.concatenate([before[name], rows[name]]))
            for name in ('sequence', 'stamp', 'stage_time')
        )
        ticks, periods = walls[steps == 1], stages[steps == 1]
        if len(ticks):
            known = {*self._periods, int(periods.min()), int(periods.max())}
            self._periods = {min(known), max(known)}
            self._longest = max(self._longest, int(ticks.max()))
            bins = np.clip(ticks // round(_TICK_RESOLUTION * 1e9), 0, _TICK_BINS - 1)
            self.histogram += np.bincount(bins, minlength=_TICK_BINS)
        self._last = rows[-1:].copy()

    def result(self, sample_time: float) -> dict[str, Any]:
        """Its own ``sample_time`` is the stage's, None where that has no clock of its own [s]."""
        samples = wall = late = 0
        if self._first is not None and self._last is not None:
            samples, wall, late = (
                int(self._last[name][0]) - int(self._first[name][0])
                for name in ('sequence', 'stamp', 'late_samples')
            )
        wall_time, stage_time = wall * 1e-9, samples * sample_time
        return {
            'sample_time': 1e-9 * min(self._periods) if len(self._periods) == 1 else None,
            'real_time_factor': stage_time / wall_time if wall_time > 0.0 else None,
            'tick_p50': self._quantile(0.5),
            'tick_p99': self._quantile(0.99),
            'tick_max': self._longest * 1e-9,
            'wall_time': wall_time,
            'late_samples': late,
        }

    def _quantile(self, fraction: float) -> float | None:
        total = int(self.histogram.sum())
        if not total:
            return None
        number = int(np.searchsorted(np.cumsum(self.histogram), fraction * total))
        return (number + 0.5) * _TICK_RESOLUTION
