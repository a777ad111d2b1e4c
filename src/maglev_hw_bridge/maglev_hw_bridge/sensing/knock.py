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
_KNOCKS = tuple(1.25**n for n in range(-15, 1))  # of the hardest push
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
    """To and fro, each pair harder than the one before, until what is pushed answers.

    No push back follows the answer: the controller sees that motion too, and brakes it.
    """

    def __init__(self, hardest: float, duration: int, shares: tuple[float, ...]) -> None:
        """In turn ``shares`` of the ``hardest`` push [m/s²], each for ``duration`` samples."""
        self._pushes = [hardest * share for share in shares]
        self._duration = duration
        self._whole = (2 * len(shares) + 1) * duration  # with a wait for the last answer
        self._sign, self._samples = 0.0, 0
        self.under_way = False

    def begin(self, sign: float) -> None:
        """Knock softly that way first."""
        self.under_way, self._sign, self._samples = True, sign, 0

    def go_on(self, counted: bool) -> bool:
        """One sample later; whether the platen must have moved and was not seen to."""
        self._samples += 1
        over = self._samples == self._whole
        self.under_way = not (counted or over)
        return over and not counted

    @property
    def acceleration(self) -> float:
        """To push with [m/s²]."""
        knock, back = divmod(self._samples // self._duration, 2)
        if not self.under_way or knock == len(self._pushes):
            return 0.0
        return (-self._sign if back else self._sign) * self._pushes[knock]


class Edges:
    """Which way encoders passed the last edge of a count: it is nearest going back."""

    def __init__(self, encoders: int) -> None:
        self._reading = np.full(encoders, math.nan)  # [m]
        self.passed = [0.0] * encoders  # 0: none yet

    def follow(self, reading: FloatArray) -> None:
        """One sample; (encoders,) [m]."""
        for i, change in enumerate((reading - self._reading).tolist()):
            if abs(change) > 0.0:  # not the first time
                self.passed[i] = math.copysign(1.0, change)
        self._reading[:] = reading


class _Asked(Pushes):
    """Knocks at x or at z."""

    def __init__(self, axis: int, hardest: float, duration: int) -> None:
        """``hardest`` push [m/s²], in samples ``duration``."""
        super().__init__(hardest, duration, _KNOCKS)
        self.axis = axis


class Knock:
    """Both axes: :meth:`look` once a sample, then :meth:`added` to what is commanded."""

    def __init__(self, parameters: BridgeParameters) -> None:
        fault, period = parameters.fault, parameters.sample_time
        duration = samples_to_push(period)
        self._patience = round(fault.silence / period)
        self._limit = fault.largest_amplitude
        self._machine = machine_constants(parameters.machine)
        self._i_q = np.zeros(4)
        self._edges = Edges(2)
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
        self._edges.follow(watched.believed[4:])
        for asked in self._asked:
            asked.under_way = asked.under_way and flying
            silent = watched.silent[3 + asked.axis]
            if asked.under_way:
                if asked.go_on(silent == 0):
                    return 3 + asked.axis
            elif 0 < self._patience <= silent:
                passed = self._edges.passed[asked.axis - X]
                asked.begin(-passed or self._leaning(watched, asked.axis))
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
