"""From dq currents to the volts that the boards put out: commutation, limits, I²t.

A phase's I²t load follows (current / continuous rating)² with a time constant. From ``derate_load``
on the peak shrinks to the continuous rating, which is left halfway to ``trip_load``; a phase that
goes on nevertheless trips.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.commutation import SCALES, phase_currents
from maglev_model.compiled import compiled

FloatArray = NDArray[np.float64]

# What drive() returns.
FINE: Final = 0
NOT_FINITE: Final = 1
OVER_LIMIT: Final = 2  # the command
OVER_CURRENT: Final = 3  # of a phase
SPENT: Final = 4  # I²t

# Indices into settings.
WAVE: Final = 0  # electrical angle per displacement, pi / tau [rad/m]
SCALE: Final = 1  # phase amplitude per dq current
PEAK: Final = 2  # [A]
CONTINUOUS: Final = 3
COMMAND_LIMIT: Final = 4
TRIP_CURRENT: Final = 5
SLEW_STEP: Final = 6  # greatest change per sample [A]
RANGE: Final = 7  # [V]
HEATING: Final = 8  # 1 - exp(-sample time / thermal time)
DERATE: Final = 9  # load
DERATED: Final = 10  # load at which only the continuous current is left
TRIP: Final = 11  # load
ANGLE: Final = 12  # of motors 1..4 at displacement 0 [rad]
SETTINGS: Final = 16


class AmplifierArrays(NamedTuple):
    """What :func:`drive` takes; twelve phases: a, b, c of motor 1, then 2, 3, 4."""

    settings: FloatArray  # (SETTINGS,)
    per_ampere: FloatArray  # (12,) [V/A], with the sign
    offset: FloatArray  # (12,) [V]
    wanted: FloatArray  # (12,) phase currents before limits [A]
    current: FloatArray  # (12,) phase currents put out [A]
    load: FloatArray  # (12,) I²t load
    volts: FloatArray  # (12,) put out [V]


@compiled
def _limit(s: FloatArray, load: float) -> float:
    """Largest current [A] a phase may carry at its I²t load."""
    if load <= s[DERATE]:
        return float(s[PEAK])
    share = min((load - s[DERATE]) / (s[DERATED] - s[DERATE]), 1.0)
    return float(s[PEAK] + share * (s[CONTINUOUS] - s[PEAK]))


@compiled
def _put_out(arrays: AmplifierArrays) -> bool:
    """Bring the wanted currents within all limits and to volts; whether a budget is spent."""
    s = arrays.settings
    spent = False
    for i in range(12):
        limit = _limit(s, arrays.load[i])
        current = min(max(arrays.wanted[i], -limit), limit)
        last = arrays.current[i]
        current = min(max(current, last - s[SLEW_STEP]), last + s[SLEW_STEP])
        volts = arrays.offset[i] + arrays.per_ampere[i] * current
        if abs(volts) > s[RANGE]:
            volts = math.copysign(s[RANGE], volts)
            current = (volts - arrays.offset[i]) / arrays.per_ampere[i]
        ratio = current / s[CONTINUOUS]
        arrays.load[i] += s[HEATING] * (ratio * ratio - arrays.load[i])
        arrays.current[i] = current
        arrays.volts[i] = volts
        spent = spent or arrays.load[i] >= s[TRIP]
    return spent


@compiled
def drive(
    arrays: AmplifierArrays, i_d: FloatArray, i_q: FloatArray, x: float, z: float
) -> tuple[int, int]:
    """Turn ``i_d``, ``i_q`` of motors 1..4 [A] at ``x``, ``z`` [m] into ``volts``.

    Returns a code and the motor or phase (from 0) it is about. When the command is refused
    (NOT_FINITE, OVER_LIMIT, OVER_CURRENT) the volts stay as they were.
    """
    s = arrays.settings
    for motor in range(4):
        if not (math.isfinite(i_d[motor]) and math.isfinite(i_q[motor])):
            return NOT_FINITE, motor
        if math.hypot(i_d[motor], i_q[motor]) > s[COMMAND_LIMIT]:
            return OVER_LIMIT, motor
    for motor in range(4):
        angle = s[ANGLE + motor] + s[WAVE] * (z if motor % 2 == 0 else x)
        a, b, c = phase_currents(i_d[motor], i_q[motor], angle, s[SCALE])
        arrays.wanted[3 * motor] = a
        arrays.wanted[3 * motor + 1] = b
        arrays.wanted[3 * motor + 2] = c
    for i in range(12):
        if abs(arrays.wanted[i]) > s[TRIP_CURRENT]:
            return OVER_CURRENT, i
    if _put_out(arrays):
        return SPENT, int(np.argmax(arrays.load))
    return FINE, 0


class Amplifiers:
    """Twelve current amplifiers; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        amplifier, commutation = parameters.amplifier, parameters.commutation
        settings = np.zeros(SETTINGS)
        settings[WAVE] = math.pi / parameters.machine.pole_pitch
        settings[SCALE] = SCALES[commutation.dq_scaling]
        settings[PEAK] = amplifier.peak_current
        settings[CONTINUOUS] = amplifier.continuous_current
        settings[COMMAND_LIMIT] = parameters.fault.command_limit
        settings[TRIP_CURRENT] = parameters.fault.over_current
        settings[SLEW_STEP] = amplifier.slew * parameters.sample_time
        settings[RANGE] = amplifier.voltage_range
        settings[HEATING] = -math.expm1(-parameters.sample_time / amplifier.thermal_time)
        settings[DERATE] = amplifier.derate_load
        settings[DERATED] = 0.5 * (amplifier.derate_load + amplifier.trip_load)
        settings[TRIP] = amplifier.trip_load
        settings[ANGLE : ANGLE + 4] = commutation.offset
        self._warn_load = amplifier.warn_load
        self.arrays = AmplifierArrays(
            settings=settings,
            per_ampere=np.array(amplifier.sign) / np.array(amplifier.gain),
            offset=np.array(amplifier.offset),
            wanted=np.zeros(12),
            current=np.zeros(12),
            load=np.zeros(12),
            volts=np.array(amplifier.offset),
        )

    def drive(self, i_d: FloatArray, i_q: FloatArray, x: float, z: float) -> tuple[int, int]:
        """Write the volts for dq currents; see :func:`drive`."""
        return drive(self.arrays, i_d, i_q, x, z)

    def drive_phases(self, current: FloatArray) -> FloatArray:
        """Volts (12,) for phase currents (12,) [A] within all limits, for commissioning."""
        self.arrays.wanted[:] = current
        _put_out(self.arrays)
        return self.arrays.volts

    def cut(self) -> FloatArray:
        """The volts (12,) that make no current, at once."""
        self.arrays.current[:] = 0.0
        self.arrays.volts[:] = self.arrays.offset
        return self.arrays.volts

    @property
    def volts(self) -> FloatArray:
        """What is to be put out (12,) [V]."""
        return self.arrays.volts

    @property
    def load(self) -> float:
        """I²t load of the hottest phase."""
        return float(np.max(self.arrays.load))

    @property
    def warm(self) -> bool:
        """Whether a warning is due."""
        return self.load >= self._warn_load
