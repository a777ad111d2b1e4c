"""What is given while the platen hovers: points in time, joined smoothly, or a step of one axis.

It is checked like any other reference, but a piece at a time, because meanwhile the hover goes on.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.quintic import minimum_jerk_time
from maglev_reference.check import UnreachableError, check_locked, check_samples
from maglev_reference.currents import check_currents
from maglev_reference.motion import Kinematics, Quintic, State
from maglev_reference.parameters import ReferenceParameters

_PIECE = 1000  # samples checked together, a few milliseconds
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
        knots = [(0.0, State.at_rest(hover), True)]
        for number, point in enumerate(points, start=1):
            knot = _state(point, columns, hover, number)
            if point.time <= knots[-1][0]:
                _check_order(number, point.time, knots[-1][0], knot, hover)
                continue
            knots.append((point.time, knot, bool(point.acceleration or not point.velocity)))
        if len(knots) == 1:
            raise UnreachableError('the trajectory has no point after its start')
        _check_end(knots[-1][1], knots[-1][0])
        self._starts = np.array([time for time, _, _ in knots[:-1]])
        self._moves = [_move(*pair) for pair in itertools.pairwise(knots)]
        self.length = knots[-1][0]

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        found = Kinematics(*(np.empty((len(time), 5)) for _ in range(3)))
        which = np.maximum(np.searchsorted(self._starts, time, side='right') - 1, 0)
        for index in np.unique(which):
            rows = which == index
            moved = self._moves[index].evaluate(time[rows] - self._starts[index])
            for values, part in zip(found, moved, strict=True):
                values[rows] = part
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


def _state(point: Point, columns: list[int], hover: FloatArray, number: int) -> State:
    state = State.at_rest(hover)
    if not np.isfinite(point.time) or point.time < 0.0:
        raise UnreachableError(f'point {number} is at {point.time:g} s')
    for values, given, name in zip(
        state, (point.position, point.velocity, point.acceleration), Point._fields[1:], strict=True
    ):
        if len(given) != len(columns) and (len(given) or name == 'position'):
            raise UnreachableError(
                f'point {number}, at {point.time:g} s, has {len(given)} values of {name} for '
                f'{len(columns)} axes'
            )
        for axis, value in zip(columns, given, strict=False):
            if not np.isfinite(value):
                raise UnreachableError(
                    f'{name} of {AXES[axis]} is {value} at {point.time:g} s, it must be finite'
                )
            values[axis] = value
    return state


def _check_order(number: int, time: float, before: float, knot: State, hover: FloatArray) -> None:
    """A point that does not come later is none, unless it is the hover itself, at time 0."""
    if number > 1 or time != 0.0:
        raise UnreachableError(
            f'point {number} is at {time:g} s, it must come after {before:g} s, the one before'
        )
    away = np.abs(knot.position - hover)
    axis = int(np.argmax(away))
    if away[axis] > _HERE:
        raise UnreachableError(
            f'{AXES[axis]} is {knot.position[axis]:.6g} {UNITS[axis]} at 0 s, it must begin where '
            f'the reference hovers, at {hover[axis]:.6g} {UNITS[axis]}'
        )
    for values, name in ((knot.velocity, 'velocity'), (knot.acceleration, 'acceleration')):
        if values.any():
            axis = int(np.argmax(np.abs(values)))
            raise UnreachableError(f'{name} of {AXES[axis]} is {values[axis]:g} at 0 s, not 0')


def _check_end(state: State, time: float) -> None:
    for values, name in ((state.velocity, 'velocity'), (state.acceleration, 'acceleration')):
        if values.any():
            axis = int(np.argmax(np.abs(values)))
            raise UnreachableError(
                f'{name} of {AXES[axis]} is {values[axis]:g} at {time:g} s, it must end at rest'
            )


def _move(before: tuple[float, State, bool], after: tuple[float, State, bool]) -> Quintic:
    """The quintic between two points; where accelerations are not given, the cubic."""
    (start, one, known), (end, two, also_known) = before, after
    time = end - start
    way = (two.position - one.position) / time
    if not known:
        one = one._replace(
            acceleration=(6.0 * way - 4.0 * one.velocity - 2.0 * two.velocity) / time
        )
    if not also_known:
        two = two._replace(
            acceleration=(2.0 * one.velocity + 4.0 * two.velocity - 6.0 * way) / time
        )
    return Quintic(one, two, time)


class Candidate:
    """A motion that is being checked, to be followed from a hover once all of it is."""

    def __init__(self, motion: Through, hover: FloatArray, parameters: ReferenceParameters) -> None:
        self.motion, self.hover = motion, hover
        self.samples = max(1, round(motion.length / parameters.sample_time))
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
