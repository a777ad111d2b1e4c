"""The machine behind the emulated boards: amplifiers, windings, platen, encoder counters.

Each phase has a current loop of its own, which the supply limits through the winding's resistance
and inductance; Park turns the twelve phase currents into the forces' i_d and i_q at the angle where
the platen really is; the plant's physics carry the platen.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import check_places, check_signs
from maglev_model.commutation import SCALES, direct_quadrature_currents
from maglev_model.compiled import compiled
from maglev_model.parameters import ParameterError
from maglev_plant.arrays import STATE, FloatArray, StageArrays, stage_arrays
from maglev_plant.dynamics import advance
from maglev_plant.encoder import encode
from maglev_plant.parameters import AmplifierParameters, PlantParameters

_TOUCH = 1e-9  # [m]
_LONGEST_STEP = 1e-4  # of currents and platen [s]; the plant takes no shorter one

# Indices into settings.
DECAY: Final = 0  # of a current error over a step
VOLTAGE_DECAY: Final = 1  # of a current at constant voltage over a step
SHORT_CURRENT: Final = 2  # what the supply's voltage drives through a winding for ever [A]
PEAK: Final = 3  # [A]
WAVE: Final = 4  # pi / tau [rad/m]
SCALE: Final = 5
GAP_COUNT: Final = 6  # [m]
HORIZONTAL_COUNT: Final = 7  # [m]
UPPER_STOP: Final = 8  # [m]
LOWER_STOP: Final = 9
SEAT_RADIUS: Final = 10  # of the stops' seats [m]
ANGLE: Final = 11  # of motors 1..4 at displacement 0 [rad]
SETTINGS: Final = 15


class RigArrays(NamedTuple):
    """What :func:`advance_rig` takes; phases a, b, c of motor 1, then 2, 3, 4."""

    settings: FloatArray  # (SETTINGS,)
    gain: FloatArray  # (12,) [A/V], with the sign; 0 for a dead phase
    offset: FloatArray  # (12,) [V]
    current: FloatArray  # (12,) flowing [A]
    impact: FloatArray  # (1,) greatest speed of a seat that met a vertical stop [m/s]


@compiled
def _flow(rig: RigArrays, volts: FloatArray) -> None:
    """Carry the phase currents over one step with the boards' outputs held."""
    s = rig.settings
    for i in range(12):
        target = rig.gain[i] * (volts[i] - rig.offset[i])
        target = min(max(target, -s[PEAK]), s[PEAK])
        wanted = target + s[DECAY] * (rig.current[i] - target)
        rest = s[VOLTAGE_DECAY] * rig.current[i]
        reach = (1.0 - s[VOLTAGE_DECAY]) * s[SHORT_CURRENT]
        rig.current[i] = min(max(wanted, rest - reach), rest + reach)


@compiled
def _commute(rig: RigArrays, state: FloatArray, before: FloatArray, command: FloatArray) -> None:
    """i_d and i_q of a step, from the mean of the phase currents before and after it."""
    s = rig.settings
    for motor in range(4):
        displacement = state[4] if motor % 2 == 0 else state[2]
        angle = s[ANGLE + motor] + s[WAVE] * displacement
        k = 3 * motor
        i_d, i_q = direct_quadrature_currents(
            0.5 * (before[k] + rig.current[k]),
            0.5 * (before[k + 1] + rig.current[k + 1]),
            0.5 * (before[k + 2] + rig.current[k + 2]),
            angle,
            s[SCALE],
        )
        command[motor], command[4 + motor] = i_d, i_q


@compiled
def _touching(s: FloatArray, state: FloatArray) -> bool:
    """Whether a seat of the platen is at a vertical stop."""
    reach = s[SEAT_RADIUS] * max(abs(state[6]), abs(state[8]))
    low, high = state[0] + reach, state[0] - reach
    return bool(low >= s[LOWER_STOP] - _TOUCH or high <= s[UPPER_STOP] + _TOUCH)


@compiled
def advance_rig(rig: RigArrays, stage: StageArrays, volts: FloatArray, steps: int) -> None:
    """Carry currents and platen over ``steps`` with the boards' outputs (12,) [V] held."""
    s = rig.settings
    state = stage.memory[STATE : STATE + 10]
    for _ in range(steps):
        before = rig.current.copy()
        _flow(rig, volts)
        _commute(rig, state, before, stage.command)
        away = not _touching(s, state)
        tilting = max(abs(state[7]), abs(state[9]))
        speed = abs(state[1]) + s[SEAT_RADIUS] * tilting
        advance(stage.scalars, stage.axes, stage.memory, stage.command)
        if away and speed > rig.impact[0] and _touching(s, state):
            rig.impact[0] = speed


@compiled
def count(rig: RigArrays, stage: StageArrays, out: NDArray[np.int64]) -> None:
    """Whole counts of the six encoders, ``out`` (6,), from absolute zero."""
    encode(stage.scalars, stage.memory, stage.reading)
    for i in range(6):
        resolution = rig.settings[GAP_COUNT] if i < 4 else rig.settings[HORIZONTAL_COUNT]
        out[i] = math.floor(stage.reading[i] / resolution + 0.5)


class Rig:
    """Amplifiers, windings, platen and counters, carried on sample by sample."""

    def __init__(self, parameters: BridgeParameters) -> None:
        """Raises ParameterError when the emulated machine cannot be."""
        emulation = parameters.emulation
        self.wiring = emulation.wiring
        self._check()
        if not (emulation.encoder.gap_resolution and emulation.encoder.horizontal_resolution):
            raise ParameterError(
                "parameters 'emulation.encoder.gap_resolution' and 'horizontal_resolution' must be"
                ' above 0: boards count'
            )
        self.steps = math.ceil(parameters.sample_time / _LONGEST_STEP - 1e-9)
        step = parameters.sample_time / self.steps
        self.stage = stage_arrays(_plant(parameters, step))
        self.arrays = RigArrays(
            settings=_settings(parameters, step),
            gain=np.array(self.wiring.gain) * np.array(self.wiring.phase_sign),
            offset=np.array(self.wiring.offset),
            current=np.zeros(12),
            impact=np.zeros(1),
        )
        self._total = np.zeros(6, dtype=np.int64)
        count(self.arrays, self.stage, self._total)
        direction = np.array(self.wiring.encoder_direction, dtype=np.int64)
        self._start = np.array(self.wiring.encoder_start) - direction * self._total
        self._direction = direction

    def _check(self) -> None:
        wiring = self.wiring
        check_places('emulation.wiring.phase', wiring.phase_board, wiring.phase_channel)
        check_places('emulation.wiring.encoder', wiring.encoder_board, wiring.encoder_channel)
        check_signs('emulation.wiring.phase_sign', wiring.phase_sign)
        check_signs('emulation.wiring.encoder_direction', wiring.encoder_direction)

    def advance(self, volts: FloatArray) -> None:
        """One sample with ``volts`` (12,) by phase held."""
        advance_rig(self.arrays, self.stage, volts, self.steps)

    def counts(self) -> NDArray[np.int64]:
        """What the six counters stand at, before roll-over, shape (6,)."""
        count(self.arrays, self.stage, self._total)
        counts: NDArray[np.int64] = self._start + self._direction * self._total
        return counts

    @property
    def state(self) -> FloatArray:
        """True x1..x10, shape (10,), a copy."""
        return np.array(self.stage.memory[STATE : STATE + 10])

    def place(self, position: FloatArray, velocity: FloatArray | None = None) -> None:
        """Put the platen somewhere, as by hand: (5,) each [m, rad] and per second."""
        self.stage.memory[STATE : STATE + 10 : 2] = position
        self.stage.memory[STATE + 1 : STATE + 10 : 2] = 0.0 if velocity is None else velocity

    @property
    def phase_current(self) -> FloatArray:
        """Currents flowing in the twelve phases [A], a copy."""
        return np.array(self.arrays.current)

    @property
    def impact(self) -> float:
        """Greatest speed at which a seat met a vertical stop so far [m/s]."""
        return float(self.arrays.impact[0])

    def forget_impact(self) -> None:
        """Begin to look for the greatest impact anew."""
        self.arrays.impact[0] = 0.0


def _plant(parameters: BridgeParameters, step: float) -> PlantParameters:
    """The plant without amplifiers of its own, one step a sample."""
    emulation = parameters.emulation
    return PlantParameters(
        sample_time=step,
        substeps=1,
        seed=emulation.seed,
        machine=parameters.machine,
        amplifier=dataclasses.replace(
            AmplifierParameters(),
            bandwidth=0.0,
            peak_current=1e6,
            continuous_current=1e6,
            dq_scaling=parameters.commutation.dq_scaling,
        ),
        encoder=emulation.encoder,
        guide=emulation.guide,
        stop=emulation.stop,
        disturbance=emulation.disturbance,
        offset=emulation.offset,
        initial=emulation.initial,
    )


def _settings(parameters: BridgeParameters, step: float) -> FloatArray:
    winding, encoder = parameters.emulation.winding, parameters.emulation.encoder
    settings = np.zeros(SETTINGS)
    settings[DECAY] = math.exp(-2.0 * math.pi * winding.bandwidth * step)
    settings[VOLTAGE_DECAY] = math.exp(-winding.resistance / winding.inductance * step)
    settings[SHORT_CURRENT] = winding.voltage / winding.resistance
    settings[PEAK] = winding.peak_current
    settings[WAVE] = math.pi / parameters.machine.pole_pitch
    settings[SCALE] = SCALES[parameters.commutation.dq_scaling]
    settings[GAP_COUNT] = encoder.gap_resolution
    settings[HORIZONTAL_COUNT] = encoder.horizontal_resolution
    settings[UPPER_STOP] = parameters.machine.gap_min
    settings[LOWER_STOP] = parameters.machine.gap_max
    settings[SEAT_RADIUS] = parameters.emulation.stop.seat_radius
    settings[ANGLE : ANGLE + 4] = parameters.emulation.wiring.angle
    return settings
