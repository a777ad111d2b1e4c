"""What the controller does by itself when the reference is lost: brake, descend, rest.

Cutting the current is no way down: below about 28.7 mm the platen would be pulled up into the
stop. So the controller brakes all axes, levels the tilts, lowers y to the lower stop and ends the
current there.
"""

from __future__ import annotations

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import FloatArray
from maglev_model.quintic import braking_times, coasted, quintic_to_zero

_OFF_THE_STOPS = 0.03  # share of its way that an axis keeps off its stops: a bridge lands from 0.02


class Landing:
    """A smooth way from any reference to rest on the lower stop; arrays in output order, (5,).

    Braking takes x and z to rest where they would come to by themselves, the tilts to 0, and y to
    rest; then y descends to the lower stop by a minimum-jerk profile, and is held there until
    ``done``. The way stays within the stops of a reference that would have; an acceleration above
    ``jumps.acceleration`` is let go at once, for what undoes it smoothly may be more than weight.
    """

    def __init__(
        self,
        parameters: ControllerParameters,
        position: FloatArray,
        velocity: FloatArray,
        acceleration: FloatArray,
    ) -> None:
        """Begin at a reference: position [m, rad], velocity, acceleration, (5,) each."""
        machine = parameters.machine
        self._period = parameters.sample_time
        self._braking = parameters.landing.braking_time
        self._descent = parameters.landing.descent_time
        self._settle = parameters.landing.settle_time
        self._floor = machine.gap_max
        lower, upper = np.array(machine.lower_limit), np.array(machine.upper_limit)
        self._start = np.clip(np.asarray(position, dtype=np.float64), lower, upper)
        self._velocity = np.array(velocity, dtype=np.float64)
        most = np.array(parameters.jumps.acceleration)
        self._acceleration = np.clip(acceleration, -most, most)
        self._brakes = braking_times(
            self._start, self._velocity, lower, upper, self._braking, self._acceleration
        )
        self._level = self._resting_place(lower, upper)
        self._elapsed = 0.0
        self.done = False

    def _resting_place(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """Where braking ends: where it would come to by itself, off the stops, tilts level."""
        margin = _OFF_THE_STOPS * (upper - lower)
        end = self._start + coasted(self._velocity, self._acceleration, self._brakes)
        least, most = lower + margin, upper - margin
        most[0] = upper[0]
        level: FloatArray = np.clip(end, least, most)
        level[3:] = 0.0
        return level

    def step(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity, acceleration (5,) of the next sample; the last sets ``done``."""
        self._elapsed += self._period
        position, velocity, acceleration = self._level.copy(), np.zeros(5), np.zeros(5)
        if self._elapsed < self._braking:
            for axis in range(5):
                to_position, to_velocity, to_acceleration = quintic_to_zero(
                    self._start[axis] - self._level[axis],
                    self._velocity[axis],
                    self._acceleration[axis],
                    self._brakes[axis],
                    self._elapsed,
                )
                position[axis] += to_position
                velocity[axis], acceleration[axis] = to_velocity, to_acceleration
            return position, velocity, acceleration
        offset, velocity[0], acceleration[0] = quintic_to_zero(
            self._level[0] - self._floor, 0.0, 0.0, self._descent, self._elapsed - self._braking
        )
        position[0] = self._floor + offset
        self.done = self._elapsed >= self._braking + self._descent + self._settle
        return position, velocity, acceleration
