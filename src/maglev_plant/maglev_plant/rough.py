"""One sample of a stage with effects of a real one; which, is composed here and nowhere else.

Per sample: temperatures, then the command through converters and amplifiers. Per step: the floor,
the phase currents, a Runge-Kutta step of all forces, what set-valued friction holds, bristles,
stops, flexible modes. Without effects it is ``dynamics.advance`` but for rounding.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.commutation import electrical_angle, phase_currents
from maglev_model.compiled import borrowing, compiled
from maglev_model.compiled.arrays import copy_to
from maglev_model.machine import Machine
from maglev_plant.amplifier import limit_phase, set_targets
from maglev_plant.arrays import StageArrays
from maglev_plant.effects.arrays import EffectArrays
from maglev_plant.effects.balance import add_weight
from maglev_plant.effects.drive import aim, command_phases
from maglev_plant.effects.floor import shake
from maglev_plant.effects.friction import (
    add_friction,
    apply_coulomb,
    begin_step,
    carry_bristles,
)
from maglev_plant.effects.heat import warm_factors
from maglev_plant.effects.modes import carry_modes
from maglev_plant.effects.motors import add_motor_forces
from maglev_plant.effects.winding import carry_currents, flowing_currents
from maglev_plant.stops import apply_coupled_stops, apply_stops


@borrowing
def _add_springs(
    effects: EffectArrays, machine: Machine, state: FloatArray, force: FloatArray
) -> None:
    """Torsional springs, of the potential I k_s tilt²/2 (1 + growth (y - middle))."""
    growth = effects.spring_growth
    share = 1.0 + growth * (state[0] - effects.spring_gap)
    phi, theta = machine.I_x * machine.k_s_phi, machine.I_x * machine.k_s_theta
    force[3] -= phi * share * state[6]
    force[4] -= theta * share * state[8]
    force[0] -= 0.5 * growth * (phi * state[6] * state[6] + theta * state[8] * state[8])


@borrowing
def rough_derivative(
    stage: StageArrays,
    machine: Machine,
    time: float,
    elapsed: float,
    state: FloatArray,
    current: FloatArray,
    force: FloatArray,
    rate: FloatArray,
) -> None:
    """Rate of change of x1..x10 between the stops, ``elapsed`` [s] into a step.

    Arguments as of ``dynamics.derivative``; ``force`` (5,) is for its use.
    """
    effects, mass = stage.effects, stage.effects.balance.mass
    for axis in range(5):
        velocity = state[2 * axis + 1]
        push = stage.constant[axis] - stage.viscous[axis] * velocity
        if stage.sinusoids:
            angle = stage.angular_frequency[axis] * time + stage.phase[axis]
            push += stage.amplitude[axis] * math.sin(angle)
        force[axis] = mass[axis] * push
    force[1] -= effects.cable * state[2]
    force[2] -= effects.cable * state[4]
    if machine.motors != 1.0:
        _add_springs(effects, machine, state, force)
    add_weight(effects.balance, state, force)
    add_motor_forces(machine, effects.motors, state, current, force)
    add_friction(effects.friction, state, elapsed, force)
    for axis in range(5):
        total = 0.0
        for other in range(5):
            total += effects.balance.inverse[axis, other] * force[other]
        if effects.floor.on and axis < 3:
            total -= effects.floor.acceleration[axis]
        free = not stage.locked[axis]
        rate[2 * axis] = state[2 * axis + 1] if free else 0.0
        rate[2 * axis + 1] = total if free else 0.0


@borrowing
def _blend(state: FloatArray, rate: FloatArray, step: float, out: FloatArray) -> None:
    for i in range(10):
        out[i] = state[i] + step * rate[i]


@borrowing
def _runge_kutta(
    stage: StageArrays, machine: Machine, time: float, current: FloatArray, work: FloatArray
) -> None:
    """One free step by the classical method; ``current`` at its start, middle, end."""
    step, state = stage.step, stage.state
    k_1, k_2, k_3, k_4, probe = work[0], work[1], work[2], work[3], work[4]
    force, half = work[6, :5], 0.5 * step
    rough_derivative(stage, machine, time, 0.0, state, current[0], force, k_1)
    _blend(state, k_1, half, probe)
    rough_derivative(stage, machine, time + half, half, probe, current[1], force, k_2)
    _blend(state, k_2, half, probe)
    rough_derivative(stage, machine, time + half, half, probe, current[1], force, k_3)
    _blend(state, k_3, step, probe)
    rough_derivative(stage, machine, time + step, step, probe, current[2], force, k_4)
    for i in range(10):
        state[i] += step / 6.0 * (k_1[i] + 2.0 * (k_2[i] + k_3[i]) + k_4[i])


@compiled
def _take_command(stage: StageArrays, machine: Machine) -> None:
    """Turn the commanded i_d and i_q into phase currents, as the commutation knows the angle."""
    wanted = np.zeros(12)
    for motor in range(stage.effects.motors.first, stage.effects.motors.last):
        displacement = stage.state[4] if motor % 2 == 0 else stage.state[2]
        angle = electrical_angle(machine, displacement)
        i_d, i_q = stage.command[motor], stage.command[4 + motor]
        a, b, c = phase_currents(i_d, i_q, angle)
        wanted[3 * motor] = limit_phase(stage, 3 * motor, a)
        wanted[3 * motor + 1] = limit_phase(stage, 3 * motor + 1, b)
        wanted[3 * motor + 2] = limit_phase(stage, 3 * motor + 2, c)
    command_phases(stage.effects.drive, stage.seed, stage.sample, wanted)


@compiled
def _currents_of_step(
    stage: StageArrays,
    machine: Machine,
    number: int,
    lag: FloatArray,
    aimed: FloatArray,
    current: FloatArray,
) -> None:
    """i_d and i_q at the start, in the middle and at the end of a step, ``current`` (3, 8)."""
    effects = stage.effects
    if effects.by_phases:
        aim(effects.drive, number / stage.substeps, (number + 1) / stage.substeps, aimed)
        carry_currents(
            machine, effects.motors, effects.winding, stage.state, aimed, stage.step, current[0]
        )
        copy_to(current[0], current[1])
        copy_to(current[0], current[2])
        return
    for i in range(8):
        current[0, i] = stage.target[i] + stage.lag_start * lag[i]
        current[1, i] = stage.target[i] + stage.lag_middle * lag[i]
        lag[i] *= stage.lag_end
        current[2, i] = stage.target[i] + lag[i]


@compiled
def _carry_platen(
    stage: StageArrays, machine: Machine, time: float, current: FloatArray, work: FloatArray
) -> None:
    """One step of the platen and of what it drags along."""
    effects, before = stage.effects, work[5]
    copy_to(stage.state, before)
    if effects.floor.on:
        shake(effects.floor)
    begin_step(effects.friction, stage.state, stage.step)
    _runge_kutta(stage, machine, time, current, work)
    if effects.friction.set_valued:
        apply_coulomb(effects.friction, effects.balance.inverse, before, stage.state, stage.step)
    if effects.balance.coupled:
        apply_coupled_stops(stage, before, work[4])
    else:
        apply_stops(stage, before)
    carry_bristles(effects.friction, before, stage.state, stage.step)
    carry_modes(effects.modes, before, stage.state, stage.step)


@compiled
def advance_rough(stage: StageArrays, machine: Machine) -> None:
    """Carry a stage over one sample, as ``dynamics.advance``."""
    effects = stage.effects
    start = stage.sample * (stage.step * stage.substeps)
    if effects.heat.on:
        magnets, copper = warm_factors(effects.heat, start)
        effects.motors.warm_magnet, effects.winding.warm_copper = magnets, copper
    if effects.by_phases:
        effects.winding.limited = False
        _take_command(stage, machine)
    else:
        set_targets(stage, machine)
    lag = stage.flowing - stage.target if stage.lag_end > 0.0 else np.zeros(8)
    current, aimed, work = np.zeros((3, 8)), np.zeros(12), np.zeros((7, 10))
    for n in range(stage.substeps):
        _currents_of_step(stage, machine, n, lag, aimed, current)
        _carry_platen(stage, machine, start + n * stage.step, current, work)
    if effects.by_phases:
        flowing_currents(effects.motors, effects.winding, stage.state, stage.flowing)
    else:
        copy_to(current[2], stage.flowing)
    stage.sample += 1
