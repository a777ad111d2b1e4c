"""Asks x and z, when they have not counted for a while in flight, whether they count at all.

At small gaps the motors are commutated so that they pull less than they would without current, and
push a platen that is not where x or z says along, the harder the farther it is off: a stuck encoder
ends in a run to a stop. Neither gaps nor model can tell in time, for friction may as well hold the
platen. So one that seems to stand still is knocked, pushed for some milliseconds to and fro, softly
first, for there may be little friction, then ever harder. What moves it one count in spite of the
friction that there may be, and is doubled, comes last: where nothing is counted then, it is lost.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.guard_arrays import GuardArrays
from maglev_model.axes import FloatArray, X, Z
from maglev_model.compiled import compiled
from maglev_model.machine import Machine, machine_constants
from maglev_model.platen import output_accelerations

_PUSH = 4e-3  # in either direction [s]
_KNOCKS, _GROWTH = 7, 1.5  # at the most; how much harder each is than the one before
_COUNTS = 1.2  # by which the platen is moved at least, by half of the hardest
_HARDEST = 2.0


def samples_to_push(period: float) -> int:
    """In either direction, by the period of the samples [s]."""
    return max(round(_PUSH / period), 2)


def hardest_push(parameters: BridgeParameters, axis: int, count: float) -> float:
    """By half of which a platen that friction holds moves more than a ``count`` [m]; in m/s²."""
    push = parameters.sample_time * samples_to_push(parameters.sample_time)
    return _HARDEST * (parameters.fault.friction[axis] + 2.0 * _COUNTS * count / push**2)


@compiled
def _thrust(machine: Machine, position: FloatArray, i_d: FloatArray, axis: int) -> float:
    """Acceleration along x or z by 1 A of i_q in both its motors, which alone make it [m/s²/A]."""
    i_q = np.zeros(4)
    i_q[2 - axis :: 2] = 1.0
    y, phi, theta = position[0], position[3], position[4]
    return float(output_accelerations(machine, y, phi, theta, i_d, i_q)[axis])


class Pushes:
    """To and fro, each pair harder than the one before, until what is pushed answers."""

    def __init__(self, hardest: float, duration: int, knocks: int, growth: float) -> None:
        """``hardest`` push [m/s²], the last of ``knocks``; in samples ``duration``."""
        self._softest, self._duration = hardest / growth ** (knocks - 1), duration
        self._most, self._growth = knocks, growth
        self.begin(0.0)
        self.under_way = False

    def begin(self, sign: float) -> None:
        """Knock softly that way first, unanswered so far."""
        self.under_way, self._answered = True, False
        self._knocks = 0
        self._knock(sign * self._softest)

    def _knock(self, push: float) -> None:
        """Begin one: ``push`` [m/s²] until the turn, and back for as long."""
        self._samples, self._turn, self._push = 0, self._duration, push
        self._knocks += 1

    def go_on(self, counted: bool) -> bool:
        """One sample later; whether the platen must have moved and was not seen to."""
        self._samples += 1
        if counted and not self._answered:
            self._answered, self._turn = True, min(self._turn, self._samples)
        last = self._knocks == self._most
        if self._samples < 2 * self._turn + (self._duration if last and not self._answered else 0):
            return False
        if self._answered or last:
            self.under_way = False
            return not self._answered
        self._knock(self._growth * self._push)
        return False

    @property
    def acceleration(self) -> float:
        """To push with [m/s²]."""
        if self._samples < self._turn:
            return self._push
        return -self._push if self._samples < 2 * self._turn else 0.0


class _Asked(Pushes):
    """Knocks at x or at z."""

    def __init__(self, axis: int, hardest: float, duration: int) -> None:
        """``hardest`` push [m/s²], in samples ``duration``."""
        super().__init__(hardest, duration, _KNOCKS, _GROWTH)
        self.axis = axis
        self._reading = 0.0  # [m]
        self.passed = 0.0  # which way the last edge was: it is nearest going back

    def follow(self, reading: float) -> None:
        if reading != self._reading:
            self.passed = math.copysign(1.0, reading - self._reading)
            self._reading = reading


class Knock:
    """Both axes: :meth:`look` once a sample, then :meth:`added` to what is commanded."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault, period = parameters.fault, parameters.sample_time
        duration = samples_to_push(period)
        self._patience = round(fault.silence / period)
        self._limit = fault.largest_amplitude
        self._machine = machine_constants(parameters.machine)
        self._i_q = np.zeros(4)
        nearest = np.array([parameters.machine.gap_min, 0.0, 0.0, 0.0, 0.0])
        self._asked = tuple(
            _Asked(
                axis,
                hardest_push(parameters, axis, parameters.encoder.resolution[3 + axis]),
                duration,
            )
            for axis in (X, Z)
            if _thrust(self._machine, nearest, np.zeros(4), axis)  # a single motor has none along z
        )

    def look(self, watched: GuardArrays, flying: bool) -> int | None:
        """One sample; the encoder, 4 or 5, that does not count. Ends with the flight."""
        for asked in self._asked:
            asked.follow(watched.believed[3 + asked.axis])
            asked.under_way = asked.under_way and flying
            silent = watched.silent[3 + asked.axis]
            if asked.under_way:
                if asked.go_on(silent == 0):
                    return 3 + asked.axis
            elif 0 < self._patience <= silent:
                asked.begin(-asked.passed or self._leaning(watched, asked.axis))
        return None

    @staticmethod
    def _leaning(watched: GuardArrays, axis: int) -> float:
        """Which way the currents and what disturbs it push an axis."""
        return -1.0 if watched.acceleration[axis] < watched.disturbance[axis] else 1.0

    def added(self, watched: GuardArrays, i_d: FloatArray, i_q: FloatArray) -> FloatArray:
        """``i_q`` (4,) [A] with what knocks: none while the motors have nothing left for it."""
        if not any(asked.under_way for asked in self._asked):
            return i_q
        self._i_q[:] = i_q
        for asked in self._asked:
            if not asked.under_way:
                continue
            thrust = _thrust(self._machine, watched.position, i_d, asked.axis)
            self._i_q[2 - asked.axis :: 2] += asked.acceleration / thrust
        if np.max(np.hypot(i_d, self._i_q)) <= self._limit:
            return self._i_q
        for asked in self._asked:
            asked.under_way = False
        return i_q
