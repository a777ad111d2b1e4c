"""Iterative learning: what a repeated reference needs beyond the law, learned from pass to pass.

Where the reference repeats, so does what the law does not know. At a sample in the middle of a pass
what acts on an axis is ``d = ë - w``, ë the second derivative of the measured error and w what the
law has made beyond the reference's acceleration; both are known around that sample once the pass is
over, so that a filter without phase can take their noise away:

    u⁺ = Q (u + γ_k (w - f - ë - u)),    γ_k = γ / (1 + k γ)

u is what is fed forward, and a part of w; f the friction that is; Q a low-pass of linear phase (a
windowed sinc). No model of the loop enters but the double integrator that every inverse leaves, and
its delay; and as d does not depend on u, this is the mean of what the passes showed: the counts'
noise in it falls from pass to pass. The observer is told that u and f only balance other forces, so
that its estimates, and through them the feedback, are not off by what these forces would move.

What the internal model makes by itself, the mean and the waves that come whole in the period, is
left to it: they are fed forward as they were when the reference began to repeat, whichever table
has taken over since. Otherwise both would make them while a table fades in. An axis whose reference
rests in between is fed all of it, since there its oscillators fade.

What has been flown with the least errors is kept. An error that grows, of any axis and already
within a pass, ends the learning and brings that back.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from maglev_controller.design.digits import rounded
from maglev_controller.learning_parameters import LearningParameters
from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.arrays import ControlArrays
from maglev_controller.step.learning import (
    DONE,
    GREW,
    IDLE,
    LEARNING,
    STATE,
    TABLES,
    LearningArrays,
    learn,
    look_ahead,
)
from maglev_model.axes import AXES, FloatArray
from maglev_model.parameters import ParameterError

FADING_TIME = 0.3
"""Time constant with which what is fed forward fades in, out and over [s]."""

_REMEMBERED = (STATE.names or ())[(STATE.names or ()).index('stage') :]
_WINDOW = 1.65  # half length of the filter by sample rate / (bandwidth / 2π)
_WHOLE = 1e-6  # of a sample
_SAME = np.array([[1e-6], [1e-4]])  # place and speed of a beginning [m, rad; m/s, rad/s]
_WHOLE_CYCLE = 1e-3  # of a cycle
_INTERNAL_MODELS = ('output_regulator', 'regulator_3dof')  # laws that have one
_LEAST = 0.25  # of a count: rms errors below it do not grow


class IterativeLearning:
    """Learns over passes; ``arrays`` are what :mod:`~maglev_controller.step.learning` works on."""

    def __init__(self, parameters: ControllerParameters) -> None:
        """Raises ParameterError for a period that cannot be had, or a law that does not fit."""
        given, self._sample_time = parameters.learning, parameters.sample_time
        samples = round(given.period / self._sample_time)
        kernels = _kernels(given.bandwidth, self._sample_time, parameters.input_delay)
        reach = kernels.shape[1] // 2
        _check(parameters, samples, reach)
        state = np.zeros(1, STATE)
        state['samples'], state['reach'], state['passes'] = samples, reach, given.passes
        state['gain'], state['growth'] = given.gain, given.growth**2
        state['fading'] = -math.expm1(-self._sample_time / FADING_TIME)
        state['limit'] = np.where([a.controlled for a in parameters.axes], given.largest, 0.0)
        state['floor'] = samples * (_LEAST * _counts(parameters)) ** 2
        self._start = np.zeros((0, 5))  # position and velocity where a period begins, once known
        self._measured = self._repeats = False  # the last sample, what it belongs to
        cycles, time = _cycles(parameters, samples), np.arange(samples) / samples
        self.arrays = LearningArrays(
            state=state,
            tables=np.zeros((TABLES, samples, 5)),
            made=np.zeros((samples, 5)),
            error=np.zeros((samples, 5)),
            kernels=kernels,
            history=np.zeros((max(given.passes, 1), 5)),
            cycles=cycles,
            wave=np.stack([np.cos(2.0 * np.pi * time), np.sin(2.0 * np.pi * time)]),
            parts=np.zeros((TABLES + 2, *cycles.shape, 2)),
        )
        if given.passes > 0:
            self.begin()

    @property
    def table(self) -> FloatArray:
        """What is learned over a period (N, 5) [m/s², rad/s²], with what is left to others."""
        return np.asarray(self.arrays.tables[int(self.arrays.state['used'][0])])

    @property
    def history(self) -> FloatArray:
        """Rms errors (5,) [m, rad] of each pass flown since the beginning."""
        return self.arrays.history[: int(self.arrays.state['flown'][0])]

    @property
    def learned(self) -> FloatArray:
        """A copy of what :meth:`save` writes, :attr:`table` above :attr:`history`."""
        return np.concatenate((self.table, self.history))

    @property
    def learning(self) -> bool:
        """Whether it learns, or will on the next pass."""
        return bool(self.arrays.state['stage'][0] == LEARNING)

    def begin(self) -> None:
        """Learn over all passes again, from what is fed forward now, or of what comes next."""
        if not self._repeats:
            self._start = np.zeros((0, 5))
        state = self.arrays.state
        state['stage'], state['waits'], state['recorded'] = LEARNING, True, 0
        state['flown'], state['score'], state['least'] = 0, math.inf, math.inf
        state['best'] = state['used']
        state['next'] = (state['used'] + 1) % TABLES
        state['sum'] = 0.0

    def end(self) -> None:
        """Learn no more, and go back to the best."""
        state = self.arrays.state
        if self.learning:
            state['used'], state['stage'] = state['best'], IDLE

    def rest(self) -> None:
        """Feed nothing forward, until the reference repeats again."""
        self._measured = self._repeats = False
        state = self.arrays.state
        state['share'], state['follows'], state['recorded'], state['sum'] = 0.0, False, 0, 0.0

    def redesigned(self, parameters: ControllerParameters) -> IterativeLearning:
        """The same at rest for other parameters of the law, as far as this one has come."""
        successor = IterativeLearning(parameters)
        for name in _REMEMBERED:
            successor.arrays.state[name] = self.arrays.state[name]
        successor.arrays.tables[:] = self.arrays.tables
        successor.arrays.history[:] = self.arrays.history
        successor._find_waves()
        successor._start = self._start
        successor.rest()
        return successor

    def look_ahead(
        self, control: ControlArrays, measured: bool, position: FloatArray, velocity: FloatArray
    ) -> None:
        """Tell the regulator with these arrays what to feed forward at the sample that comes.

        ``measured``: the sample, at ``position`` and ``velocity`` (5,) [m, rad, 1/s], belongs to a
        reference that is tracked, its first one after others begins a period. One that begins
        elsewhere than what is learned is another, for which nothing is fed forward.
        """
        if measured and not self._measured:
            self._repeats = self._begins(position, velocity)
        self._measured = measured
        self._repeats = self._repeats and measured
        look_ahead(self.arrays, control, self._repeats)

    def _begins(self, position: FloatArray, velocity: FloatArray) -> bool:
        """Whether what is learned begins so, which is known from the first time on."""
        start = np.stack([position, velocity])
        if not len(self._start):
            self._start = start
        return bool(np.all(np.abs(start - self._start) < _SAME))

    def learn(self, control: ControlArrays) -> None:
        """Take what the regulator with these arrays has made of the sample into account."""
        learn(self.arrays, control)

    def describe(self) -> str:
        """How it stands, in a line."""
        stage, history = int(self.arrays.state['stage'][0]), self.history
        if stage == IDLE or not len(history):
            return 'learning' if self.learning else 'not learning'
        errors = ', '.join(
            f'{name} {1e6 * first:.2f} to {1e6 * last:.2f}'
            for name, first, last in zip(AXES, history[0], history[-1], strict=True)
        )
        what = {LEARNING: 'learning', DONE: 'learned', GREW: 'ended, an error grew, after'}[stage]
        return f'{what} {len(history)} passes: rms error in 1e-6 m, rad: {errors}'

    def save(self, path: str | Path) -> None:
        """Write what is fed forward to a file, whole or not at all. Raises OSError."""
        path = Path(path)
        partial = path.with_name(f'{path.name}.tmp')
        with partial.open('wb') as file:
            np.savez(
                file,
                sample_time=self._sample_time,
                table=self.table,
                history=self.history,
                start=self._start,
            )
        os.replace(partial, path)

    def load(self, path: str | Path) -> None:
        """Feed forward what :meth:`save` wrote; what is learned begins from there.

        Raises ParameterError for a file that is none of these, or of another period.
        """
        try:
            with np.load(path, allow_pickle=False) as content:
                sample_time, table = float(content['sample_time']), content['table']
                start = content.get('start', self._start)
        except (OSError, EOFError, KeyError, ValueError, TypeError, BadZipFile) as error:
            text = f"parameter 'learning.file': cannot read {path}: {error}"
            raise ParameterError(text) from error
        wanted, limit, wrong = self.table, self.arrays.state[0]['limit'], ''
        if sample_time != self._sample_time or table.shape != wanted.shape:
            wrong = (
                f'holds {table.shape} values every {sample_time:g} s, the period is {wanted.shape} '
                f'every {self._sample_time:g} s'
            )
        elif start.shape not in ((0, 5), (2, 5)) or start.dtype != np.float64:
            wrong = 'does not say where its period begins'
        elif not (table.dtype == np.float64 and np.all(np.abs(table) <= limit)):
            wrong = f"holds what is not finite, or above 'learning.largest' ({limit.tolist()})"
        if wrong:
            raise ParameterError(f"parameter 'learning.file': {path} {wrong}")
        wanted[:], self._start = table, start
        self._find_waves()

    def _find_waves(self) -> None:
        """Of the internal models' waves, what is in the tables."""
        arrays = self.arrays
        for axis, wave in np.argwhere(arrays.cycles >= 0):
            cycles = int(arrays.cycles[axis, wave])
            rows = cycles * np.arange(arrays.wave.shape[1]) % arrays.wave.shape[1]
            share = (2.0 if cycles else 1.0) / rows.size
            found = arrays.tables[:, :, axis] @ arrays.wave[:, rows].T
            arrays.parts[:TABLES, axis, wave] = share * found


def iterative_learning(parameters: ControllerParameters) -> IterativeLearning | None:
    """What these parameters ask for, with what its file holds where that is there; None for none.

    Raises ParameterError as the class and its :meth:`~IterativeLearning.load` do, and for a file
    that nothing is learned for, that is not there to be flown, or cannot be written.
    """
    given = parameters.learning
    if given.file:
        _check_file(given)
    if given.period == 0.0:
        return None
    learning, path = IterativeLearning(parameters), Path(given.file)
    if path.is_file():
        learning.load(path)
    return learning


def _check_file(given: LearningParameters) -> None:
    path, wrong = Path(given.file), ''
    if given.period == 0.0:
        wrong = "'learning.period' is 0, nothing is learned"
    elif path.exists() and not path.is_file():
        wrong = 'that is no file'
    elif not (path.exists() or given.passes):
        wrong = "it is not there, and with 'learning.passes' 0 nothing is learned"
    elif given.passes and not os.access(path.parent, os.W_OK):
        wrong = f"what is learned cannot be written to '{path.parent}'"
    if wrong:
        raise ParameterError(f"parameter 'learning.file' is '{path}': {wrong}")


def _kernels(bandwidth: float, period: float, delay: int) -> FloatArray:
    """Weights (2, 2 R + 1) of what was made and of the error, from R samples before to R after."""
    half = math.ceil(_WINDOW * 2.0 * math.pi / (bandwidth * period))
    place = np.arange(-half, half + 1)
    low = np.sinc(bandwidth * period / math.pi * place) * np.hamming(2 * half + 1)
    low /= np.abs(np.fft.rfft(low, 64 * place.size)).max()  # nowhere above 1: nothing grows by it
    # ë in the middle of the sample in which what is fed forward acts
    bend = np.zeros(2 * (delay + 2) + 1)
    bend[2 * delay + 1 :] = np.array([0.5, -0.5, -0.5, 0.5]) / period**2
    return rounded(np.stack([np.pad(low, delay + 2), np.convolve(low, bend)]), 12)


def _cycles(parameters: ControllerParameters, samples: int) -> NDArray[np.int64]:
    """How often the waves of each axis' internal model come in a period (5, H), -1 for none.

    Those that do not come whole, and integrators in place of an internal model, are none.
    """
    period = samples * parameters.sample_time
    turns = parameters.internal_model.fundamental * period / (2.0 * np.pi)
    found = np.full((5, max(len(axis.multiples) for axis in parameters.axes)), -1)
    for row, axis in zip(found, parameters.axes, strict=True):
        if parameters.law in _INTERNAL_MODELS:
            cycles = turns * np.array(axis.multiples)
            whole = np.abs(cycles - np.round(cycles)) < _WHOLE_CYCLE
            kept = np.unique(np.round(cycles[whole]).astype(np.int64))
            row[: kept.size] = kept
    return found


def _counts(parameters: ControllerParameters) -> FloatArray:
    """A count of each axis (5,) [m, rad]."""
    gap, along = parameters.encoder.gap_resolution, parameters.encoder.horizontal_resolution
    tilt = gap / (math.sqrt(2.0) * parameters.machine.radius)
    return np.array([gap, along, along, tilt, tilt])


def _check(parameters: ControllerParameters, samples: int, reach: int) -> None:
    period, sample_time = parameters.learning.period, parameters.sample_time
    counts = period / sample_time * np.arange(1, 1001)
    whole = np.flatnonzero(np.abs(counts - np.round(counts)) < _WHOLE)
    if not whole.size or whole[0] > 0:
        fits = f'{period * (whole[0] + 1):g} s are' if whole.size else 'none is'
        raise ParameterError(
            f"parameter 'learning.period' is {period:g} s, {period / sample_time:g} samples, it "
            f'must be whole samples; of its multiples {fits}'
        )
    if parameters.learning.bandwidth * sample_time > 0.5 * math.pi:
        raise ParameterError(
            f"parameter 'learning.bandwidth' is {parameters.learning.bandwidth:g} rad/s, more than "
            f'half of what a sample time of {sample_time:g} s can hold '
            f'({math.pi / sample_time:g} rad/s)'
        )
    if samples < 4 * reach:
        raise ParameterError(
            f"parameter 'learning.period' is {period:g} s, at a 'learning.bandwidth' of "
            f'{parameters.learning.bandwidth:g} rad/s it must be {4 * reach * sample_time:g} s'
        )
