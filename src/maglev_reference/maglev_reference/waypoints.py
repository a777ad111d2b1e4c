"""Moves from rest to rest, point after point: at minimum jerk, or as fast as the machine can."""

from __future__ import annotations

import itertools
import math

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.quintic import minimum_jerk, minimum_jerk_time
from maglev_reference.fastest import Fastest
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters

_ARRIVED = 1e-9  # of a move, that may be left when it is over, for rounding


class Waypoints:
    """Straight moves between points, by ``waypoints.profile``, with a rest at each point.

    It begins with the rest at the first point. Moves and rests take whole samples. ``length`` [s]
    is up to the arrival at the last point or, when it repeats, up to the first point again.
    Before zero it stands at the first point, or repeats. Raises UnreachableError as
    :class:`Fastest`.
    """

    def __init__(self, parameters: ReferenceParameters) -> None:
        given, step = parameters.waypoints, parameters.sample_time
        fastest = given.profile == 'fastest'
        points = list(np.array(given.points(), dtype=float).T)
        self.repeats = given.repeat
        if len(points) == 1 or (self.repeats and (points[0] != points[-1]).any()):
            points.append(points[0])
        self._moves = [
            Fastest(a, b, parameters) if fastest and (a != b).any() else _Move(a, b, parameters)
            for a, b in itertools.pairwise(points)
        ]
        dwell = round(given.dwell / step)
        took = [math.ceil(move.duration / step - 1e-9) for move in self._moves]
        starts = np.cumsum([dwell] + [count + dwell for count in took[:-1]])
        self._starts = starts * step
        self.length = float(starts[-1] + took[-1]) * step

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        if self.repeats:
            time = np.mod(time, self.length)
        number = np.maximum(np.searchsorted(self._starts, time, side='right') - 1, 0)
        made = Kinematics(*np.empty((3, len(time), 5)))
        for k in np.unique(number):
            rows = number == k
            moved = self._moves[k].evaluate(time[rows] - self._starts[k])
            for column, values in zip(made, moved, strict=True):
                column[rows] = values
        return made


class _Move:
    """From ``start`` to ``target`` (5,) at minimum jerk, as fast as ``waypoints.*`` let it."""

    def __init__(
        self, start: FloatArray, target: FloatArray, parameters: ReferenceParameters
    ) -> None:
        given, step = parameters.waypoints, parameters.sample_time
        self._start, self._way = start, target - start
        times = map(minimum_jerk_time, self._way, given.velocity, given.acceleration)
        self.duration = max(1, *(math.ceil(time / step - 1e-9) for time in times)) * step

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        s = np.clip(time / self.duration, 0.0, 1.0)
        s = np.where(s > 1.0 - _ARRIVED, 1.0, s)
        way, slope, bend = (np.outer(values, self._way) for values in minimum_jerk(s))
        return Kinematics(self._start + way, slope / self.duration, bend / np.square(self.duration))
