"""Minimum-jerk moves from rest to rest, point after point."""

from __future__ import annotations

import math

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.quintic import minimum_jerk, minimum_jerk_time
from maglev_reference.motion import Kinematics
from maglev_reference.trajectory_parameters import WaypointParameters

_ARRIVED = 1e-9  # of a move, that may be left when it is over, for rounding


class Waypoints:
    """Straight moves between points, each as fast as its limits let it, with a rest at each point.

    It begins with the rest at the first point. Moves and rests take whole samples. ``length`` [s]
    is up to the arrival at the last point or, when it repeats, up to the first point again.
    Before zero it stands at the first point, or repeats.
    """

    def __init__(self, parameters: WaypointParameters, sample_time: float) -> None:
        points = np.array(parameters.points(), dtype=float).T
        self.repeats = parameters.repeat
        if self.repeats and not np.array_equal(points[0], points[-1]):
            points = np.concatenate((points, points[:1]))
        self._from = points[:-1] if len(points) > 1 else points
        self._change = np.diff(points, axis=0) if len(points) > 1 else np.zeros((1, 5))
        dwell = max(0, round(parameters.dwell / sample_time))
        samples = [
            max(
                1,
                *(
                    math.ceil(minimum_jerk_time(*move) / sample_time - 1e-9)
                    for move in zip(
                        change, parameters.velocity, parameters.acceleration, strict=True
                    )
                ),
            )
            for change in self._change
        ]
        starts = np.cumsum([dwell] + [count + dwell for count in samples[:-1]])
        self._starts = starts * sample_time
        self._times = np.array(samples) * sample_time
        self.length = float(starts[-1] + samples[-1]) * sample_time

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        if self.repeats:
            time = np.mod(time, self.length)
        move = np.maximum(np.searchsorted(self._starts, time, side='right') - 1, 0)
        took = self._times[move][:, None]
        s = np.clip((time - self._starts[move])[:, None] / took, 0.0, 1.0)
        s = np.where(s > 1.0 - _ARRIVED, 1.0, s)
        change = self._change[move]
        way, slope, bend = minimum_jerk(s)
        return Kinematics(
            self._from[move] + change * way, change * slope / took, change * bend / took**2
        )
