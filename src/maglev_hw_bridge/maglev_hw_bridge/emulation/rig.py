"""The machine behind the emulated boards: amplifiers, windings, platen, encoder counters.

Each phase has a current loop of its own, which the supply limits through the winding's resistance
and inductance; Park turns the twelve phase currents into the forces' i_d and i_q at the angle where
the platen really is; the plant's physics carry the platen.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import check_places, check_signs
from maglev_model.axes import FloatArray
from maglev_model.commutation import direct_quadrature_currents
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.compiled.records import Block, Record
from maglev_model.machine import Machine
from maglev_model.machine_array import machine_from_array
from maglev_model.parameters import ParameterError
from maglev_plant.arrays import StageArrays, stage_arrays
from maglev_plant.dynamics import advance
from maglev_plant.effects.drive import aim, command_phases
from maglev_plant.effects.motors import along_across
from maglev_plant.effects.parameters import DriveParameters
from maglev_plant.effects.winding import carry_currents, set_current_loop
from maglev_plant.encoder import encode
from maglev_plant.parameters import AmplifierParameters, PlantParameters

CountArray = NDArray[np.int64]

_TOUCH = 1e-9  # [m]
_LONGEST_STEP = 1e-4  # of currents and platen [s]; the plant takes no shorter one


class RigArrays(Record):
    """What :func:`advance_rig` takes; phases a, b, c of motor 1, then 2, 3, 4."""

    decay: float  # of a current error over a step
    voltage_decay: float  # of a current at constant voltage over a step
    short_current: float  # what the supply's voltage drives through a winding for ever [A]
    peak: float  # [A]
    wave: float  # pi / tau [rad/m]
    angle: Annotated[FloatArray, 4]  # of motors 1..4 at displacement 0 [rad]
    gain: Annotated[FloatArray, 12]  # [A/V], with the sign; 0 for a dead phase
    offset: Annotated[FloatArray, 12]  # [V]
    driven: bool  # whether converters, latency or spread are among the stage's effects
    gap_count: float  # [m]
    horizontal_count: float  # [m]
    direction: Annotated[CountArray, 6]  # +1 or -1, of the six counters
    start: Annotated[CountArray, 6]  # what they count at absolute zero
    upper_stop: float  # [m]
    lower_stop: float  # [m]
    seat_radius: float  # of the stops' seats [m]
    current: Annotated[FloatArray, 12]  # flowing [A]
    impact: float  # greatest speed of a seat that met a vertical stop [m/s]


@borrowing
def _flow(rig: RigArrays, targets: FloatArray) -> None:
    """Carry the phase currents over one step towards their targets (12,) [A]."""
    for i in range(12):
        target = targets[i]
        wanted = target + rig.decay * (rig.current[i] - target)
        rest = rig.voltage_decay * rig.current[i]
        reach = (1.0 - rig.voltage_decay) * rig.short_current
        rig.current[i] = min(max(wanted, rest - reach), rest + reach)


@borrowing
def _commute(rig: RigArrays, stage: StageArrays, before: FloatArray) -> None:
    """i_d and i_q of a step, from the mean of the phase currents before and after it."""
    for motor in range(4):
        along, _ = along_across(stage.effects.motors, motor, stage.state[2], stage.state[4])
        angle = rig.angle[motor] + rig.wave * along
        k = 3 * motor
        i_d, i_q = direct_quadrature_currents(
            0.5 * (before[k] + rig.current[k]),
            0.5 * (before[k + 1] + rig.current[k + 1]),
            0.5 * (before[k + 2] + rig.current[k + 2]),
            angle,
        )
        stage.command[motor], stage.command[4 + motor] = i_d, i_q


@compiled
def _aim(
    rig: RigArrays, stage: StageArrays, wanted: FloatArray, n: int, steps: int, out: FloatArray
) -> None:
    """What the current loops aim at in step ``n`` of a sample, ``out`` (12,) [A]."""
    if rig.driven:
        aim(stage.effects.drive, n / steps, (n + 1) / steps, out)
    else:
        copy_to(wanted, out)
    for i in range(12):
        out[i] = min(max(out[i], -rig.peak), rig.peak)


@compiled
def _carry(rig: RigArrays, stage: StageArrays, machine: Machine, targets: FloatArray) -> None:
    """Carry the phase currents over one step, and set i_d and i_q by which the forces go."""
    effects = stage.effects
    if effects.winding.on:
        carry_currents(
            machine,
            effects.motors,
            effects.winding,
            stage.state,
            targets,
            stage.step,
            stage.command,
        )
        copy_to(effects.winding.phase, rig.current)
        return
    before = rig.current.copy()
    _flow(rig, targets)
    _commute(rig, stage, before)


@borrowing
def _touching(rig: RigArrays, stage: StageArrays) -> bool:
    """Whether a seat of the platen is at a vertical stop."""
    y, phi, theta = stage.state[0], stage.state[6], stage.state[8]
    reach = rig.seat_radius * max(abs(phi), abs(theta))
    low, high = y + reach, y - reach
    return bool(low >= rig.lower_stop - _TOUCH or high <= rig.upper_stop + _TOUCH)


@compiled
def advance_rig(rig_block: Block, stage_block: Block, volts: FloatArray, steps: int) -> None:
    """Carry currents and platen over ``steps`` with the boards' outputs (12,) [V] held."""
    rig: RigArrays = rig_block[0]
    stage: StageArrays = stage_block[0]
    state = stage.state
    machine = machine_from_array(stage.machine)
    wanted, targets = rig.gain * (volts - rig.offset), np.empty(12)
    if rig.driven:
        command_phases(stage.effects.drive, stage.seed, stage.sample, wanted)
    for n in range(steps):
        _aim(rig, stage, wanted, n, steps, targets)
        _carry(rig, stage, machine, targets)
        away = not _touching(rig, stage)
        tilting = max(abs(state[7]), abs(state[9]))
        speed = abs(state[1]) + rig.seat_radius * tilting
        advance(stage_block)
        if away and speed > rig.impact and _touching(rig, stage):
            rig.impact = speed


@borrowing
def count(rig_block: Block, stage_block: Block, out: CountArray) -> None:
    """What the six counters stand at, before roll-over, ``out`` (6,)."""
    rig: RigArrays = rig_block[0]
    stage: StageArrays = stage_block[0]
    encode(stage_block)
    for i in range(6):
        resolution = rig.gap_count if i < 4 else rig.horizontal_count
        counts = math.floor(stage.reading[i] / resolution + 0.5)
        out[i] = rig.start[i] + rig.direction[i] * counts


@compiled
def tell(stage_block: Block, out: FloatArray) -> None:
    """The truth behind the counts taken last, ``out`` (24,), as :meth:`Rig.tell` has it."""
    stage: StageArrays = stage_block[0]
    copy_to(stage.state, out[:10])
    copy_to(stage.command, out[10:18])
    for i in range(6):
        out[18 + i] = stage.effects.sensor.own[i] - stage.reading[i]


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
        try:
            plant = _plant(parameters, step)
        except ParameterError as error:
            raise ParameterError(f"of the emulated machine ('emulation.*'): {error}") from error
        self.stage = stage_arrays(plant)
        self.arrays = _rig_arrays(parameters, step)
        self.stage.effects.by_phases = False  # phases are the rig's
        winding = self.stage.effects.winding
        winding.offset[:] = self.arrays.angle
        set_current_loop(winding, emulation.winding.bandwidth, step)
        self.arrays.start[:] = np.array(self.wiring.encoder_start) - self.counts()

    def _check(self) -> None:
        wiring = self.wiring
        check_places('emulation.wiring.phase_channel', wiring.phase_board, wiring.phase_channel)
        check_places(
            'emulation.wiring.encoder_channel', wiring.encoder_board, wiring.encoder_channel
        )
        check_signs('emulation.wiring.phase_sign', wiring.phase_sign)
        check_signs('emulation.wiring.encoder_direction', wiring.encoder_direction)

    def advance(self, volts: FloatArray) -> None:
        """One sample with ``volts`` (12,) by phase held."""
        advance_rig(self.arrays.block, self.stage.block, volts, self.steps)

    def counts(self) -> CountArray:
        """What the six counters stand at, before roll-over, shape (6,)."""
        counts = np.empty(6, np.int64)
        count(self.arrays.block, self.stage.block, counts)
        return counts

    def tell(self, out: FloatArray) -> None:
        """What was counted last was taken of, into ``out`` (24,).

        x1..x10; i_d, then i_q flowing [A]; how much more than whole counts the scales have [m].
        """
        tell(self.stage.block, out)

    @property
    def state(self) -> FloatArray:
        """True x1..x10, shape (10,), a copy."""
        return np.array(self.stage.state)

    def place(self, position: FloatArray, velocity: FloatArray | None = None) -> None:
        """Put the platen somewhere, as by hand: (5,) each [m, rad] and per second."""
        self.stage.state[::2] = position
        self.stage.state[1::2] = 0.0 if velocity is None else velocity
        self.stage.effects.winding.last[:] = self.stage.state

    @property
    def phase_current(self) -> FloatArray:
        """Currents flowing in the twelve phases [A], a copy."""
        return np.array(self.arrays.current)

    @property
    def impact(self) -> float:
        """Greatest speed at which a seat met a vertical stop so far [m/s]."""
        return self.arrays.impact

    def forget_impact(self) -> None:
        """Begin to look for the greatest impact anew."""
        self.arrays.impact = 0.0


def _plant(parameters: BridgeParameters, step: float) -> PlantParameters:
    """The plant without amplifiers of its own, one step a sample."""
    emulation = parameters.emulation
    return PlantParameters(
        sample_time=step,
        substeps=1,
        seed=emulation.seed,
        machine=parameters.machine,
        amplifier=AmplifierParameters(bandwidth=0.0, peak_current=1e6, continuous_current=1e6),
        encoder=emulation.encoder,
        guide=emulation.guide,
        stop=emulation.stop,
        disturbance=emulation.disturbance,
        offset=emulation.offset,
        initial=emulation.initial,
        effects=parameters.effects,
    )


def _rig_arrays(parameters: BridgeParameters, step: float) -> RigArrays:
    emulation, machine = parameters.emulation, parameters.machine
    winding, wiring = emulation.winding, emulation.wiring
    return RigArrays(
        decay=math.exp(-2.0 * math.pi * winding.bandwidth * step),
        voltage_decay=math.exp(-winding.resistance / winding.inductance * step),
        short_current=winding.voltage / winding.resistance,
        peak=winding.peak_current,
        wave=math.pi / machine.pole_pitch,
        angle=np.array(wiring.angle) + parameters.effects.motor.commutation,
        gain=np.array(wiring.gain) * np.array(wiring.phase_sign),
        offset=wiring.offset,
        driven=parameters.effects.drive != DriveParameters(),
        gap_count=emulation.encoder.gap_resolution,
        horizontal_count=emulation.encoder.horizontal_resolution,
        direction=wiring.encoder_direction,
        upper_stop=machine.gap_min,
        lower_stop=machine.gap_max,
        seat_radius=emulation.stop.seat_radius,
    )
