"""What is given while the platen hovers: points in time, joined smoothly, or a step of one axis.

It is checked like any other reference, but a piece at a time, because meanwhile the hover goes on.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.quintic import evaluate_quintic, minimum_jerk_time, quintic_coefficients
from maglev_reference.check import UnreachableError, check_locked, check_samples
from maglev_reference.currents import check_currents
from maglev_reference.motion import Kinematics, State
from maglev_reference.parameters import ReferenceParameters

_PIECE = 1000  # samples checked together, a few milliseconds
_LONGEST = 36_000.0  # as a run's duration [s]
_HERE = 1e-6  # how far a first point at time 0 may be from where the platen hovers [m, rad]


class Point(NamedTuple):
    """One point: ``time`` [s] from the start, and values of the axes that are named, or none."""

    time: float
    position: Sequence[float]  # [m, rad]
    velocity: Sequence[float] = ()
    acceleration: Sequence[float] = ()


class Through:
    """The motion from a hover through points; ``length`` [s] is up to the last, where it stays.

    Between two points a quintic, with the velocities and accelerations that are given. Without
    accelerations it is the cubic of positions and velocities, without either a move from rest to
    rest. Axes that are not named stay. Raises :class:`UnreachableError` with axis and time for what
    makes no such motion.
    """

    def __init__(self, names: Sequence[str], points: Sequence[Point], hover: FloatArray) -> None:
        columns = _columns(names)
        if not points:
            raise UnreachableError('the trajectory has no points')
        knots = _knots(points, columns, hover)
        if len(knots.time) == 1:
            raise UnreachableError('the trajectory has no point after its start')
        end = State(*(values[-1] for values in knots.state))
        _check_still(end, knots.time[-1], 'it must end at rest')
        self._end = end.position
        self._starts, self._durations = knots.time[:-1], np.diff(knots.time)
        self._coefficients = _coefficients(knots)
        self.length = float(knots.time[-1])

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        which = np.maximum(np.searchsorted(self._starts, time, side='right') - 1, 0)
        found = Kinematics(
            *evaluate_quintic(
                self._coefficients[:, which], self._durations[which], time - self._starts[which]
            )
        )
        found.position[time >= self.length] = self._end
        found.velocity[time >= self.length] = 0.0
        found.acceleration[time > self.length] = 0.0  # a cubic arrives with some
        return found


def step(axis: str, distance: float, hover: FloatArray, parameters: ReferenceParameters) -> Through:
    """From a hover (5,) at minimum jerk by a ``distance`` [m, rad], in the time of a shaped step.

    Raises :class:`UnreachableError` for what is no axis, and for more than its ``limits.step``.
    """
    (column,) = _columns((axis,))
    limit, velocity = parameters.limits.step[column], parameters.limits.velocity[column]
    if not abs(distance) <= limit:
        unit = UNITS[column]
        raise UnreachableError(
            f'{axis} shall step by {distance:g} {unit}, it may by {limit:g} {unit} (limits.step)'
        )
    least = minimum_jerk_time(distance, velocity, parameters.steps.acceleration[column])
    end = Point(max(parameters.steps.shaping_time, least), (float(hover[column]) + distance,))
    return Through((axis,), (end,), hover)


def _columns(names: Sequence[str]) -> list[int]:
    for name in names:
        if name not in AXES:
            raise UnreachableError(f"there is no axis '{name}', there are {', '.join(AXES)}")
    if not names or len(set(names)) < len(names):
        raise UnreachableError(f'joint_names are {list(names)}: name each axis once, at least one')
    return [AXES.index(name) for name in names]


class _Knots(NamedTuple):
    """Where a motion passes at ``time`` (n,) [s]; and whether its acceleration (n,) is known."""

    time: FloatArray
    state: Kinematics
    known: NDArray[np.bool_]


def _knots(points: Sequence[Point], columns: list[int], hover: FloatArray) -> _Knots:
    """The hover and the points after it."""
    given = np.array([point.time for point in points])
    for number in np.flatnonzero(~((given >= 0.0) & (given <= _LONGEST))):
        raise UnreachableError(
            f'point {number + 1} is at {given[number]:g} s, it must lie in [0, {_LONGEST:g}] s'
        )
    begun = int(given[0] == 0.0)  # with the hover itself
    time = np.concatenate((np.zeros(1 - begun), given))
    state = Kinematics(np.tile(hover, (len(time), 1)), *np.zeros((2, len(time), 5)))
    known = np.ones(len(time), dtype=np.bool_)
    for values, name in zip(state, Point._fields[1:], strict=True):
        rows, there = _values(points, name, columns)
        values[1 - begun :, columns] = rows
        if name == 'velocity':
            known[1 - begun :] = ~there
        elif name == 'acceleration':
            known[1 - begun :] |= there
    if begun:
        _check_start(State(*(values[0] for values in state)), hover)
        state.position[0], known[0] = hover, True
    for number in np.flatnonzero(np.diff(time) <= 0.0):
        raise UnreachableError(
            f'point {number + 1 + begun} is at {time[number + 1]:g} s, '
            f'it must come after {time[number]:g} s, the one before'
        )
    return _Knots(time, state, known)


def _values(
    points: Sequence[Point], name: str, columns: list[int]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """What points name a value for (n, axes), else 0, and which do (n,)."""
    rows = [getattr(point, name) for point in points]
    sizes = np.array([len(row) for row in rows])
    there = sizes > 0
    for number in np.flatnonzero((sizes != len(columns)) & (there | (name == 'position'))):
        raise UnreachableError(
            f'point {number + 1}, at {points[int(number)].time:g} s, has {sizes[number]} values of '
            f'{name} for {len(columns)} axes'
        )
    values = np.zeros((len(points), len(columns)))
    if there.any():
        values[there] = [row for row in rows if len(row)]
    for number, column in np.argwhere(~np.isfinite(values)):
        raise UnreachableError(
            f'{name} of {AXES[columns[column]]} is {values[number, column]} at '
            f'{points[int(number)].time:g} s, it must be finite'
        )
    return values, there


def _check_start(state: State, hover: FloatArray) -> None:
    """A first point at time 0 is the hover itself."""
    away = np.abs(state.position - hover)
    axis = int(np.argmax(away))
    if away[axis] > _HERE:
        raise UnreachableError(
            f'{AXES[axis]} is {state.position[axis]:.6g} {UNITS[axis]} at 0 s, it must begin where '
            f'the reference hovers, at {hover[axis]:.6g} {UNITS[axis]}'
        )
    _check_still(state, 0.0, 'not 0')


def _check_still(state: State, time: float, must: str) -> None:
    for values, name in zip(state[1:], State._fields[1:], strict=True):
        axis = int(np.argmax(np.abs(values)))
        if values[axis] != 0.0:
            raise UnreachableError(
                f'{name} of {AXES[axis]} is {values[axis]:g} at {time:g} s, {must}'
            )


def _coefficients(knots: _Knots) -> FloatArray:
    """Quintics (6, n - 1, 5) between knots; where accelerations are not known, cubics."""
    time = np.diff(knots.time)[:, None]
    before, after = ([values[part] for values in knots.state] for part in (np.s_[:-1], np.s_[1:]))
    way = (after[0] - before[0]) / time
    leaving = (6.0 * way - 4.0 * before[1] - 2.0 * after[1]) / time
    arriving = (2.0 * before[1] + 4.0 * after[1] - 6.0 * way) / time
    before[2] = np.where(knots.known[:-1, None], before[2], leaving)
    after[2] = np.where(knots.known[1:, None], after[2], arriving)
    return quintic_coefficients(State(*before), State(*after), time)


class Candidate:
    """A motion that is being checked, to be followed from a hover once all of it is."""

    def __init__(self, motion: Through, hover: FloatArray, parameters: ReferenceParameters) -> None:
        self.motion, self.hover = motion, hover
        self.samples = max(1, math.ceil(motion.length / parameters.sample_time - 1e-9))
        self._parameters = parameters
        self._checked = 0

    def check(self) -> bool:
        """Check some more of it; whether it is all checked.

        Raises :class:`UnreachableError` with axis and time, from its start, for what cannot be
        followed.
        """
        period, first = self._parameters.sample_time, self._checked
        last = min(first + _PIECE, self.samples)
        samples = self.motion.evaluate(period * np.arange(first, last + 1, dtype=np.float64))
        measured = np.ones(len(samples.position), dtype=np.bool_)
        check_locked(samples.position, measured, first * period, self._parameters)
        check_samples(samples, first * period, self._parameters)
        check_currents(samples, first * period, self._parameters)
        self._checked = last
        return last == self.samples
