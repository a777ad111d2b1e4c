"""What the platen follows while it is measured: a course, or a sequence of steps."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import plugin_function
from maglev_model.quintic import minimum_jerk_time
from maglev_reference.check import UnreachableError
from maglev_reference.curves import Chirp, Helix, Sinusoids, Square
from maglev_reference.fastest import Fastest
from maglev_reference.motion import Checked, Kinematics, Motion, Quintic, Stand, State
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.waypoints import Waypoints

_PERIODS = 200  # of the slowest sinusoid, in which a sum of sinusoids may repeat
_WHOLE = 1e-3  # of a period, by which a whole one may be missed


class Delayed:
    """A motion whose time ``start`` [s] is this motion's time zero."""

    def __init__(self, motion: Motion, start: float) -> None:
        self._motion = motion
        self._start = start

    def evaluate(self, time: FloatArray) -> Kinematics:
        """The motion at ``time + start``."""
        return self._motion.evaluate(time + self._start)


class Course(NamedTuple):
    """The motion of the tracking window; its time zero is where the window begins.

    ``period`` [s] is when it repeats, ``length`` [s] how long a course is that does not; a sum of
    sinusoids may have neither. ``lines`` are the angular frequencies [rad/s] of each output, where
    they are known beforehand.
    """

    motion: Motion
    period: float | None = None
    length: float | None = None
    lines: tuple[tuple[float, ...], ...] = ((),) * 5


class Passing(Motion, Protocol):
    """A motion that has an end, ``length`` [s], or repeats from there."""

    length: float
    repeats: bool


def course(parameters: ReferenceParameters) -> Course:
    """The course of ``trajectory``, which is not ``steps``; of a dotted path, its ``course``.

    Raises ParameterError for what cannot be built: a file that is not as it must be, corners
    larger than their square.
    """
    home, fundamental = np.array(parameters.home), parameters.internal_model.fundamental
    match parameters.trajectory:
        case 'sinusoids':
            return _lined(Sinusoids.sums(parameters.sinusoids, fundamental))
        case 'circle':
            return _lined(Sinusoids.circle(parameters.circle, home, fundamental))
        case 'lissajous':
            return _lined(Sinusoids.lissajous(parameters.lissajous, home, fundamental))
        case 'helix':
            helix = Helix(parameters.helix, home, fundamental)
            return Course(helix, period=helix.period)
        case 'square':
            square = Square(parameters.square, home)
            return Course(square, period=square.period)
        case 'waypoints':
            return _passing(Waypoints(parameters))
        case 'file':
            from maglev_reference.path_file import PathFile

            return _passing(PathFile(parameters.file))
        case 'chirp':
            chirp = Chirp(parameters.chirp, home)
            lines: list[tuple[float, ...]] = [()] * 5
            lines[chirp.axis] = parameters.chirp.frequency
            return Course(chirp, length=chirp.length, lines=tuple(lines))
        case 'hold':
            return Course(Stand(home))
        case name:
            own: Course = plugin_function('trajectory', name, 'course', gives=Course)(parameters)
            return _checked(own, f"parameter 'trajectory' is '{name}'")


def _checked(own: Course, given: str) -> Course:
    """A course from outside, which a parameter has ``given``."""
    for name, time in (('period', own.period), ('length', own.length)):
        if time is not None and not (isinstance(time, float | int) and 0.0 < time < math.inf):
            raise ParameterError(
                f'{given}, whose {name} is {time!r}: it must be above 0 s, or None'
            )
    return own._replace(motion=Checked(own.motion, given))


def _lined(sinusoids: Sinusoids) -> Course:
    lines = tuple(
        tuple(sorted({term.frequency for term in sinusoids.terms if term.axis == axis}))
        for axis in range(5)
    )
    return Course(sinusoids, period=_common_period(lines), lines=lines)


def _common_period(lines: tuple[tuple[float, ...], ...]) -> float | None:
    """The time [s] in which every frequency makes whole periods, None when there is none."""
    frequencies = np.array(sorted({line for axis in lines for line in axis}))
    if not frequencies.size:
        return None
    for count in range(1, _PERIODS + 1):
        made = count * frequencies / frequencies[0]
        if np.abs(made - np.round(made)).max() < _WHOLE:
            return 2.0 * math.pi * count / float(frequencies[0])
    return None


def _passing(motion: Passing) -> Course:
    if motion.repeats:
        return Course(motion, period=motion.length)
    return Course(motion, length=motion.length)


class Step(NamedTuple):
    """One step: all five outputs (5,) before and after it, and the motion between."""

    start: FloatArray
    target: FloatArray
    motion: Motion
    jumps: bool


def steps(parameters: ReferenceParameters) -> list[Step]:
    """The steps in order.

    Raises UnreachableError for one larger than the limit of its axis, or longer than ``duration``,
    which would be cut short and judged against where it never gets.
    """
    sequence = []
    table, longest = parameters.steps, parameters.duration + 0.5 * parameters.sample_time
    home = np.array(parameters.home)
    for number, (axis, start, target) in enumerate(
        zip(table.axis, table.start, table.target, strict=True), start=1
    ):
        index = AXES.index(axis)
        limit = parameters.limits.step[index]
        if abs(target - start) > limit * (1.0 + 1e-9):
            raise UnreachableError(
                f'unreachable reference: step {number}, of {axis} from {start:g} to {target:g} '
                f'{UNITS[index]}, is larger than {limit:g} {UNITS[index]} (limits.step)'
            )
        before, after = home.copy(), home.copy()
        before[index], after[index] = start, target
        motion: Motion = Stand(after)
        if table.shaped and table.profile == 'fastest' and start != target:
            motion = Fastest(before, after, parameters)
        elif table.shaped:
            least = minimum_jerk_time(target - start, math.inf, table.acceleration[index])
            duration = max(table.shaping_time, least)
            motion = Quintic(State.at_rest(before), State.at_rest(after), duration)
        if isinstance(motion, Fastest | Quintic) and motion.duration > longest:
            raise UnreachableError(
                f'unreachable reference: step {number} takes {motion.duration:.4g} s, its segment '
                f'lasts {parameters.duration:g} s (duration)'
            )
        sequence.append(Step(before, after, motion, not table.shaped))
    return sequence
