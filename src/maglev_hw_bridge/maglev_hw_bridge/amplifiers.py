"""From dq currents to the volts that the boards put out: commutation, limits, I²t.

A phase's I²t load follows (current / continuous rating)² with a time constant. From ``derate_load``
on the peak shrinks to the continuous rating, which is left halfway to ``trip_load``; a phase that
goes on nevertheless trips.
"""

from __future__ import annotations

import math
from typing import Annotated, Final

import numpy as np

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import FloatArray
from maglev_model.commutation import phase_currents
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.compiled.records import Block, Record

# What drive() returns.
FINE: Final = 0
NOT_FINITE: Final = 1
OVER_LIMIT: Final = 2  # the command
OVER_CURRENT: Final = 3  # of a phase
SPENT: Final = 4  # I²t


class AmplifierArrays(Record):
    """What :func:`drive` takes; twelve phases: a, b, c of motor 1, then 2, 3, 4."""

    wave: float  # electrical angle per displacement, pi / tau [rad/m]
    angle: Annotated[FloatArray, 4]  # of motors 1..4 at displacement 0 [rad]
    command_limit: float  # of a motor's dq amplitude [A]
    trip_current: float  # of a phase [A]
    peak: float  # [A]
    continuous: float  # [A]
    slew_step: float  # greatest change per sample [A]
    voltage_range: float  # [V]
    heating: float  # 1 - exp(-sample time / thermal time)
    derate: float  # load from which on the peak shrinks
    derated: float  # load at which only the continuous current is left
    trip: float  # load
    per_ampere: Annotated[FloatArray, 12]  # [V/A], with the sign
    offset: Annotated[FloatArray, 12]  # [V]
    wanted: Annotated[FloatArray, 12]  # phase currents before limits [A]
    current: Annotated[FloatArray, 12]  # phase currents put out [A]
    load: Annotated[FloatArray, 12]  # I²t load
    volts: Annotated[FloatArray, 12]  # put out [V]


@borrowing
def _limit(amplifier: AmplifierArrays, load: float) -> float:
    """Largest current [A] a phase may carry at its I²t load."""
    peak, continuous = amplifier.peak, amplifier.continuous
    if load <= amplifier.derate:
        return peak
    way = min((load - amplifier.derate) / (amplifier.derated - amplifier.derate), 1.0)
    return peak + way * (continuous - peak)


@borrowing
def _put_out(amplifier: AmplifierArrays) -> bool:
    """Bring the wanted currents within all limits and to volts; whether a budget is spent."""
    slew_step, voltage_range = amplifier.slew_step, amplifier.voltage_range
    spent = False
    for i in range(12):
        limit = _limit(amplifier, amplifier.load[i])
        current = min(max(amplifier.wanted[i], -limit), limit)
        last = amplifier.current[i]
        current = min(max(current, last - slew_step), last + slew_step)
        volts = amplifier.offset[i] + amplifier.per_ampere[i] * current
        if abs(volts) > voltage_range:
            volts = math.copysign(voltage_range, volts)
            current = (volts - amplifier.offset[i]) / amplifier.per_ampere[i]
        ratio = current / amplifier.continuous
        amplifier.load[i] += amplifier.heating * (ratio * ratio - amplifier.load[i])
        amplifier.current[i] = current
        amplifier.volts[i] = volts
        spent = spent or amplifier.load[i] >= amplifier.trip
    return spent


@compiled
def _drive_phases(block: Block, current: FloatArray) -> None:
    amplifier: AmplifierArrays = block[0]
    copy_to(current, amplifier.wanted)
    _put_out(amplifier)


@borrowing
def drive(block: Block, i_d: FloatArray, i_q: FloatArray, x: float, z: float) -> tuple[int, int]:
    """Turn ``i_d``, ``i_q`` of motors 1..4 [A] at ``x``, ``z`` [m] into ``volts``.

    Returns a code and the motor or phase (from 0) it is about. When the command is refused
    (NOT_FINITE, OVER_LIMIT, OVER_CURRENT) the volts stay as they were.
    """
    amplifier: AmplifierArrays = block[0]
    for motor in range(4):
        if not (math.isfinite(i_d[motor]) and math.isfinite(i_q[motor])):
            return NOT_FINITE, motor
        if math.hypot(i_d[motor], i_q[motor]) > amplifier.command_limit:
            return OVER_LIMIT, motor
    for motor in range(4):
        angle = amplifier.angle[motor] + amplifier.wave * (z if motor % 2 == 0 else x)
        a, b, c = phase_currents(i_d[motor], i_q[motor], angle)
        amplifier.wanted[3 * motor] = a
        amplifier.wanted[3 * motor + 1] = b
        amplifier.wanted[3 * motor + 2] = c
    for i in range(12):
        if abs(amplifier.wanted[i]) > amplifier.trip_current:
            return OVER_CURRENT, i
    if _put_out(amplifier):
        return SPENT, int(np.argmax(amplifier.load))
    return FINE, 0


class Amplifiers:
    """Twelve current amplifiers; :attr:`arrays` serve compiled code."""

    def __init__(self, parameters: BridgeParameters) -> None:
        amplifier, commutation = parameters.amplifier, parameters.commutation
        self._warn_load = amplifier.warn_load
        self._thermal_time = amplifier.thermal_time
        self.arrays = AmplifierArrays(
            wave=math.pi / parameters.machine.pole_pitch,
            angle=commutation.offset,
            command_limit=parameters.fault.command_limit,
            trip_current=parameters.fault.over_current,
            peak=amplifier.peak_current,
            continuous=amplifier.continuous_current,
            slew_step=amplifier.slew * parameters.sample_time,
            voltage_range=amplifier.voltage_range,
            heating=-math.expm1(-parameters.sample_time / amplifier.thermal_time),
            derate=amplifier.derate_load,
            derated=0.5 * (amplifier.derate_load + amplifier.trip_load),
            trip=amplifier.trip_load,
            per_ampere=np.array(amplifier.sign) / np.array(amplifier.gain),
            offset=amplifier.offset,
            volts=amplifier.offset,
        )

    def drive(self, i_d: FloatArray, i_q: FloatArray, x: float, z: float) -> tuple[int, int]:
        """Write the volts for dq currents; see :func:`drive`."""
        return drive(self.arrays.block, i_d, i_q, x, z)

    def drive_phases(self, current: FloatArray) -> FloatArray:
        """Volts (12,) for phase currents (12,) [A] within all limits, for commissioning."""
        _drive_phases(self.arrays.block, current)
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

    def cool(self, time: float) -> None:
        """Let them be without current for a time [s]."""
        self.arrays.load[:] *= math.exp(-time / self._thermal_time)

    @property
    def cooling_time(self) -> float:
        """For how long they have to cool before current may flow [s]; 0 where it may now."""
        hot, limit = self.load, self.arrays.derate
        return self._thermal_time * math.log(hot / limit) if hot > limit else 0.0

    @property
    def warm(self) -> bool:
        """Whether a warning is due."""
        return self.load >= self._warn_load
