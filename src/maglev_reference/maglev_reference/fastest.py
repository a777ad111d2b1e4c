"""Straight moves from rest to rest, as fast as currents, voltage and levitation allow.

Along the way s from 0 to 1 the machine's model tells at every place how much it can speed up and
slow down, all five outputs together. The fastest move speeds up as much as it can from the start
and slows down as much as it can to the end, and changes over where both speeds meet (Bobrow's
phase plane). A running mean over ``smoothing`` then makes jumps of the acceleration ramps, which
costs that much time. Both are repeated with a smaller share of the limits, and with a longer mean,
until the samples of the result are within them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray, Y
from maglev_reference.check import UnreachableError, utilisation, within
from maglev_reference.currents import current_utilisation, motor_currents
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.voltages import voltage_utilisation

BoolArray = NDArray[np.bool_]

LEAST_ATTRACTION = 0.15
"""Share of the weight that a falling platen is carried with; the law's own is a little less."""

_PLACES = 161  # along the way
_HALVINGS = 24
_ROUNDS = 3  # friction is that at the speed of the round before
_SHARES = np.arange(0.9, 0.4, -0.02)
_LONGER = 1.25  # from one smoothing to the next
_SMOOTHINGS = 24


class Fastest:
    """The fastest move from ``start`` to ``target`` (5,) [m, rad]; it stays there.

    Raises :class:`UnreachableError` where the platen cannot even be held, or the voltage not kept.
    """

    def __init__(
        self, start: FloatArray, target: FloatArray, parameters: ReferenceParameters
    ) -> None:
        self._start, self._way = np.array(start), np.array(target) - np.array(start)
        self._parameters, self._gravity = parameters, parameters.machine.gravity
        self._mean = parameters.limits.smoothing
        self._plan_within_limits()

    @property
    def duration(self) -> float:
        """From rest to rest [s]."""
        return float(self._time[-1] + self._mean)

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position and velocity at each time (n,) [s], and the mean acceleration of the sample."""
        step = self._parameters.sample_time
        _, after, _ = self._smooth(time + step)
        place, speed, over = self._smooth(time)
        place[over], speed[over] = 1.0, 0.0
        bend = np.where(over, 0.0, (after - speed) / step)
        return Kinematics(
            self._start + np.outer(place, self._way),
            np.outer(speed, self._way),
            np.outer(bend, self._way),
        )

    def _smooth(self, time: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Place and speed, and whether the move is over, at each time."""
        now, before = self._raw(time), self._raw(time - self._mean)
        place, speed = ((a - b) / self._mean for a, b in zip(now, before, strict=True))
        return place, speed, time >= self.duration * (1.0 - 1e-12)

    def _raw(self, time: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Integral of the place, and the place, before smoothing."""
        t = np.clip(time, 0.0, self._time[-1])
        k = np.clip(np.searchsorted(self._time, t, side='right') - 1, 0, len(self._bend) - 1)
        h, speed, bend = t - self._time[k], self._speed[k], self._bend[k]
        place = self._place[k] + h * (speed + 0.5 * h * bend)
        integral = self._integral[k] + h * (self._place[k] + h * (speed / 2.0 + h * bend / 6.0))
        return integral + np.maximum(time - self._time[-1], 0.0), place

    def _plan_within_limits(self) -> None:
        for _ in range(_SMOOTHINGS):
            for share in _SHARES:
                self._plan(share)
                samples = self._samples()
                used = max(
                    utilisation(samples, self._parameters),
                    current_utilisation(samples, self._parameters),
                )
                if within(used):
                    break
            voltage = voltage_utilisation(samples, self._parameters)
            if voltage <= 1.0:
                return
            smoothest, self._mean = self._mean, self._mean * _LONGER
        limit = self._parameters.limits.voltage
        raise UnreachableError(
            f'unreachable reference: the move from {self._start.tolist()} by {self._way.tolist()} '
            f'takes {voltage * limit:.3g} V, even where its acceleration turns in {smoothest:.2g} '
            f's, it must take at most {limit:g} V (limits.voltage)'
        )

    def _samples(self) -> Kinematics:
        step = self._parameters.sample_time
        return self.evaluate(np.arange(0.0, self.duration + step, step))

    def _plan(self, share: float) -> None:
        """Times, places and speeds of the move before smoothing, at ``share`` of the limits."""
        place = np.linspace(0.0, 1.0, _PLACES)
        spacing = place[1]
        limit = np.array(self._parameters.limits.velocity)
        moving = self._way != 0.0
        top = float(np.min(limit[moving] / np.abs(self._way[moving])))
        speed = np.full(_PLACES, 0.5 * top)
        for _ in range(_ROUNDS):
            faster, slower = (share * bound for bound in self._bounds(place, speed))
            square = np.full(_PLACES, top**2)
            square[0] = square[-1] = 0.0
            for k in range(1, _PLACES):
                gain = 2.0 * spacing * min(faster[k - 1], faster[k])
                square[k] = min(square[k], square[k - 1] + gain)
            for k in range(_PLACES - 2, -1, -1):
                gain = 2.0 * spacing * min(slower[k], slower[k + 1])
                square[k] = min(square[k], square[k + 1] + gain)
            speed = np.sqrt(square)
        took = 2.0 * spacing / (speed[1:] + speed[:-1])
        self._time = np.concatenate(([0.0], np.cumsum(took)))
        self._place, self._speed, self._bend = place, speed, np.diff(speed) / took
        area = took * (place[:-1] + took * (speed[:-1] / 2.0 + took * self._bend / 6.0))
        self._integral = np.concatenate(([0.0], np.cumsum(area)))

    def _bounds(self, place: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How much the way can be sped up and slowed down at each place [1/s²]."""
        limit = np.array(self._parameters.limits.acceleration)
        moving = self._way != 0.0
        most = float(np.min(limit[moving] / np.abs(self._way[moving])))
        found = []
        for sign in (1.0, -1.0):
            low, high = np.zeros(_PLACES), np.full(_PLACES, most)
            if not self._possible(place, speed, low).all():
                raise UnreachableError(
                    f'unreachable reference: nothing is left of the currents to move from '
                    f'{self._start.tolist()} by {self._way.tolist()}'
                )
            fits = self._possible(place, speed, sign * high)
            low[fits] = most
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                fits = self._possible(place, speed, sign * middle)
                low, high = np.where(fits, middle, low), np.where(fits, high, middle)
            found.append(low)
        return found[0], found[1]

    def _possible(self, place: FloatArray, speed: FloatArray, bend: FloatArray) -> BoolArray:
        """Whether the currents suffice (n,), and leave the platen attracted."""
        samples = Kinematics(
            self._start + np.outer(place, self._way),
            np.outer(speed, self._way),
            np.outer(bend, self._way),
        )
        direct, quadrature, possible = motor_currents(samples, self._parameters)
        largest = np.hypot(direct, quadrature).max(axis=1)
        carried = samples.acceleration[:, Y] <= (1.0 - LEAST_ATTRACTION) * self._gravity
        enough = largest <= self._parameters.limits.current
        return np.asarray(possible & carried & enough)
