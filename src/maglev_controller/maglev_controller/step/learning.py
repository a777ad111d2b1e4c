"""Iterative learning, a sample at a time.

:class:`~maglev_controller.learning.IterativeLearning` fills the arrays and explains the law.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_controller.step.arrays import ControlArrays, Record
from maglev_controller.step.rest import REST
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing

IDLE: Final = 0
"""Nothing is learned; what was learned is fed forward."""
LEARNING: Final = 1
DONE: Final = 2
"""All passes are flown; the best of what was learned stays."""
GREW: Final = 3
"""An error grew; learning ended with the best."""

TABLES: Final = 3
"""One that is flown, one that is written, the best."""

KEPT: Final = TABLES
"""Of the waves that are fed forward all the time, those of the table that it began with."""

SUMS: Final = TABLES + 1
"""Of the table that is written, so far."""

RESTED: Final = 1
MOVED: Final = 2
SETTLED: Final = 0.2
"""From when on it counts whether a repeated reference rests or moves [s]."""

NO_WORSE: Final = 1.05
"""A pass whose squared errors are this by the least ones, or less, is as good: counts differ."""

STATE: Final = np.dtype(
    [
        ('samples', 'i8'),  # of a period, N
        ('reach', 'i8'),  # of the kernels, R
        ('passes', 'i8'),  # to learn over
        ('gain', 'f8'),
        ('growth', 'f8'),  # of a sum of squares
        ('fading', 'f8'),  # share of the way to full or none that is gone in a sample
        ('limit', 'f8', 5),  # [m/s², rad/s²]
        ('floor', 'f8', 5),  # sum of squares of a pass below which nothing grows or gets better
        ('stage', 'i8'),  # IDLE to GREW
        ('waits', '?'),  # for the period's beginning, to learn
        ('recorded', 'i8'),  # samples, without a break
        ('follows', '?'),  # whether the last sample belonged to the repeated reference
        ('rests', 'i8', 5),  # RESTED and MOVED since that began, where oscillators fade
        ('sample', 'i8'),  # since that began
        ('share', 'f8', TABLES),  # of each table that is fed forward
        ('used', 'i8'),  # table that is fed forward
        ('next', 'i8'),  # table that is written
        ('best', 'i8'),  # table that had the least errors
        ('flown', 'i8'),  # passes
        ('score', 'f8'),  # the least
        ('sum', 'f8', 5),  # of squared errors in this pass
        ('first', 'f8', 5),  # the same of the first pass, or the floor where that is larger
        ('least', 'f8', 5),  # of the best
    ],
    align=True,
)


class LearningArrays(NamedTuple):
    """What learning works on, N samples of a period."""

    state: NDArray[np.void]  # (1,) of STATE
    tables: FloatArray  # (3, N, 5), by place in the period [m/s², rad/s²]
    made: FloatArray  # (N, 5), beyond reference and friction [m/s², rad/s²]
    error: FloatArray  # (N, 5) [m, rad]
    kernels: FloatArray  # (2, 2 R + 1), of `made` and of `error`
    history: FloatArray  # (passes, 5), rms errors [m, rad]
    cycles: NDArray[np.int64]  # (5, H) in a period, of the internal models' waves; -1: none
    wave: FloatArray  # (2, N), cosine and sine over a period
    parts: FloatArray  # (3 + 2, 5, H, 2), of the waves in each table, in KEPT and in SUMS


NO_LEARNING: Final = LearningArrays(
    np.zeros(1, STATE),
    np.zeros((TABLES, 1, 5)),
    np.zeros((1, 5)),
    np.zeros((1, 5)),
    np.zeros((2, 1)),
    np.zeros((1, 5)),
    np.zeros((5, 0), np.int64),
    np.zeros((2, 1)),
    np.zeros((TABLES + 2, 5, 0, 2)),
)
"""For compiled loops in which nothing is learned."""


@borrowing
def _waves(learning: LearningArrays, axis: int, place: int) -> float:
    """What of the shares of all tables the internal model makes by itself [m/s², rad/s²].

    Of an axis that rests in between that is nothing: oscillators fade there, and the observer that
    believes counts less is off otherwise by what it is not told. Of one that never moves, the mean.
    """
    state, parts, total = learning.state[0], learning.parts, 0.0
    if state.rests[axis] == RESTED + MOVED:
        return total
    for wave in range(learning.cycles.shape[1]):
        cycles = learning.cycles[axis, wave]
        if cycles < 0 or (cycles > 0 and state.rests[axis] == RESTED):
            continue
        row = (cycles * place) % state.samples
        cosine, sine = learning.wave[0, row], learning.wave[1, row]
        for table in range(TABLES):
            a = parts[table, axis, wave, 0] - parts[KEPT, axis, wave, 0]
            b = parts[table, axis, wave, 1] - parts[KEPT, axis, wave, 1]
            total += state.share[table] * (a * cosine + b * sine)
    return total


@borrowing
def _add_waves(learning: LearningArrays, axis: int, place: int, value: float) -> None:
    """Count one row of the table that is written towards its waves."""
    state, sums = learning.state[0], learning.parts[SUMS]
    for wave in range(learning.cycles.shape[1]):
        cycles = learning.cycles[axis, wave]
        if cycles < 0:
            continue
        row, share = (cycles * place) % state.samples, (2.0 if cycles > 0 else 1.0) / state.samples
        sums[axis, wave, 0] += share * value * learning.wave[0, row]
        sums[axis, wave, 1] += share * value * learning.wave[1, row]


@borrowing
def _copy_waves(learning: LearningArrays, source: int, goal: int) -> None:
    parts = learning.parts
    for axis in range(5):
        for wave in range(learning.cycles.shape[1]):
            for i in range(2):
                parts[goal, axis, wave, i] = parts[source, axis, wave, i]


@borrowing
def _begin_sums(learning: LearningArrays) -> None:
    """A pass ends: errors, and the waves of the table that is written, count anew."""
    for axis in range(5):
        learning.state[0].sum[axis] = 0.0
        for wave in range(learning.cycles.shape[1]):
            for i in range(2):
                learning.parts[SUMS, axis, wave, i] = 0.0


@borrowing
def look_ahead(learning: LearningArrays, control: ControlArrays, follows: bool) -> None:
    """Tell the law what is to be fed forward at the sample that comes.

    ``follows`` tells that the sample belongs to the reference that repeats; it fades in and out.
    What the internal model makes by then is left to it when another table takes over.
    """
    state, axes = learning.state[0], control.records[0].axes
    if follows and not state.follows:
        state.sample = state.recorded = 0
        _copy_waves(learning, state.used, KEPT)
        for axis in range(5):
            state.rests[axis] = 0
    state.follows = follows
    place = state.sample % state.samples
    for axis in range(5):
        axes[axis].learned = 0.0
    for table in range(TABLES):
        goal = 1.0 if follows and table == state.used else 0.0
        state.share[table] += state.fading * (goal - state.share[table])
        for axis in range(5):
            axes[axis].learned += state.share[table] * learning.tables[table, place, axis]
    for axis in range(5):
        limit, fed = state.limit[axis], axes[axis].learned - _waves(learning, axis, place)
        axes[axis].learned = min(max(fed, -limit), limit)


@borrowing
def _write_next(learning: LearningArrays, place: int) -> None:
    """One row of the next table, from what lies around it."""
    state, samples, reach = learning.state[0], learning.state[0].samples, learning.state[0].reach
    gain = state.gain / (1.0 + state.gain * state.flown)
    for axis in range(5):
        known = shown = 0.0
        for m in range(2 * reach + 1):
            row = (place + m - reach) % samples
            known += learning.kernels[0, m] * learning.tables[state.used, row, axis]
            shown += learning.kernels[0, m] * learning.made[row, axis]
            shown -= learning.kernels[1, m] * learning.error[row, axis]
        limit, value = state.limit[axis], known + gain * (shown - known)
        limited = min(max(value, -limit), limit)
        learning.tables[state.next, place, axis] = limited
        _add_waves(learning, axis, place, limited)


@borrowing
def _grown(state: Record) -> bool:
    for axis in range(5):
        if state.sum[axis] > max(state.growth * state.least[axis], state.floor[axis]):
            return True
    return False


@borrowing
def _end(state: Record, stage: int) -> None:
    """Go back to the best."""
    state.used, state.stage = state.best, stage


@borrowing
def _judge(learning: LearningArrays) -> None:
    """A pass is over: keep its table when it is the best, and go on with the next."""
    state = learning.state[0]
    score = 0.0
    for axis in range(5):
        learning.history[state.flown, axis] = np.sqrt(state.sum[axis] / state.samples)
        if state.flown == 0:
            state.first[axis] = max(state.sum[axis], state.floor[axis])
        score += state.sum[axis] / state.first[axis]
    state.flown += 1
    if score < NO_WORSE * state.score:
        state.best, state.score = state.used, min(score, state.score)
        for axis in range(5):
            state.least[axis] = state.sum[axis]
    _copy_waves(learning, SUMS, state.next)
    if state.flown >= state.passes:
        _end(state, DONE)
        return
    state.used = state.next
    state.next = 0
    while state.next == state.used or state.next == state.best:
        state.next += 1


@borrowing
def _record(learning: LearningArrays, control: ControlArrays, row: int) -> None:
    """What the law has made beyond reference and friction at this sample, and the error."""
    state, records = learning.state[0], control.records[0]
    sample = records.sample
    for axis in range(5):
        error, each = sample.error[axis], records.axes[axis]
        known = each.wanted_acceleration + each.friction * each.bristle
        learning.error[row, axis] = error
        learning.made[row, axis] = sample.realised[axis] - known
        state.sum[axis] += error * error
        if records.settings.rest_fades and state.sample * records.settings.period > SETTLED:
            state.rests[axis] |= MOVED if each.rested < REST else RESTED


@borrowing
def learn(learning: LearningArrays, control: ControlArrays) -> None:
    """Take what the law has made of this sample into account; moves on to the next.

    A row of the next table needs R samples to either side, so that a pass ends 2 R samples after
    the period's beginning: from then on all rows are known.
    """
    state = learning.state[0]
    state.waits = state.waits and state.sample % state.samples != 0
    if state.follows and state.stage == LEARNING and not state.waits:
        if state.recorded == 0:
            state.sample = 0
        row = state.sample % state.samples
        _record(learning, control, row)
        _write_next(learning, (state.sample - state.reach) % state.samples)
        state.recorded += 1
        ended = (state.recorded - 2 * state.reach) % state.samples == 0
        if _grown(state):
            _end(state, GREW)
        elif ended:
            if state.recorded > state.samples:
                _judge(learning)
            _begin_sums(learning)
    state.sample += 1
