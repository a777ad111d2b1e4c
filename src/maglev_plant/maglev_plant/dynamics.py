"""One sample of the stage: amplifiers, platen with friction, locks and disturbances, stops."""

from __future__ import annotations

import math

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.compiled.records import Block
from maglev_model.force_table import tabulated_coefficients
from maglev_model.machine import Machine
from maglev_model.machine_array import machine_from_array
from maglev_model.motor import forces_of_currents
from maglev_model.platen import balance, motor_gaps
from maglev_plant.amplifier import set_targets
from maglev_plant.arrays import StageArrays
from maglev_plant.rough import advance_rough
from maglev_plant.stops import apply_stops


@borrowing
def _forces(
    stage: StageArrays, machine: Machine, motor: int, gap: float, current: FloatArray
) -> tuple[float, float]:
    """F_V and F_H of a motor [N]."""
    coefficients = tabulated_coefficients(stage.effects.motors.forces, machine, gap)
    return forces_of_currents(coefficients, current[motor], current[4 + motor])


@borrowing
def _tanh(x: float) -> float:
    """Right to a rounding of 1, from one exponential, which takes half the time."""
    return 1.0 - 2.0 / (1.0 + math.exp(2.0 * x))


@borrowing
def derivative(
    stage: StageArrays,
    machine: Machine,
    time: float,
    state: FloatArray,
    current: FloatArray,
    rate: FloatArray,
) -> None:
    """Rate of change of x1..x10 between the stops: (6), (7), guides, locks and disturbances.

    ``time`` [s], ``state`` shape (10,), ``current`` i_d of motors 1..4, then i_q [A], shape (8,);
    ``rate``, shape (10,), is written.
    """
    g_1, g_2, g_3, g_4 = motor_gaps(machine, state[0], state[6], state[8])
    v_1, h_1 = _forces(stage, machine, 0, g_1, current)
    v_2, h_2 = _forces(stage, machine, 1, g_2, current)
    v_3, h_3 = _forces(stage, machine, 2, g_3, current)
    v_4, h_4 = _forces(stage, machine, 3, g_4, current)
    rate[1], rate[3], rate[5], rate[7], rate[9] = balance(
        machine, state[6], state[8], (v_1, v_2, v_3, v_4), (h_1, h_2, h_3, h_4)
    )
    for axis in range(5):
        velocity = state[2 * axis + 1]
        total = rate[2 * axis + 1] + stage.constant[axis] - stage.viscous[axis] * velocity
        if stage.coulomb[axis] > 0.0:
            total -= stage.coulomb[axis] * _tanh(velocity / stage.coulomb_velocity[axis])
        if stage.sinusoids:
            angle = stage.angular_frequency[axis] * time + stage.phase[axis]
            total += stage.amplitude[axis] * math.sin(angle)
        free = not stage.locked[axis]
        rate[2 * axis] = velocity if free else 0.0
        rate[2 * axis + 1] = total if free else 0.0


@borrowing
def _blend(state: FloatArray, rate: FloatArray, step: float, out: FloatArray) -> None:
    for i in range(10):
        out[i] = state[i] + step * rate[i]


@borrowing
def _runge_kutta(
    stage: StageArrays,
    machine: Machine,
    time: float,
    state: FloatArray,
    current: FloatArray,
    work: FloatArray,
) -> None:
    """One free step of ``state`` by the classical method; ``current`` at its start, middle, end."""
    step = stage.step
    k_1, k_2, k_3, k_4, probe = work[0], work[1], work[2], work[3], work[4]
    middle = time + 0.5 * step
    derivative(stage, machine, time, state, current[0], k_1)
    _blend(state, k_1, 0.5 * step, probe)
    derivative(stage, machine, middle, probe, current[1], k_2)
    _blend(state, k_2, 0.5 * step, probe)
    derivative(stage, machine, middle, probe, current[1], k_3)
    _blend(state, k_3, step, probe)
    derivative(stage, machine, time + step, probe, current[2], k_4)
    for i in range(10):
        state[i] += step / 6.0 * (k_1[i] + 2.0 * (k_2[i] + k_3[i]) + k_4[i])


@borrowing
def advance(block: Block) -> None:
    """Carry a stage over one sample with the commanded currents held; they must be finite.

    Takes the block of :class:`~maglev_plant.arrays.StageArrays`; callable from compiled loops.
    """
    stage: StageArrays = block[0]
    machine = machine_from_array(stage.machine)
    if stage.effects.moving:
        advance_rough(stage, machine)
        return
    set_targets(stage, machine)
    step, end = stage.step, stage.lag_end
    start = stage.sample * (step * stage.substeps)
    state, target, lag = stage.state, stage.target, stage.lag
    current, work = stage.current, stage.work
    before = work[5]
    for i in range(8):
        lag[i] = stage.flowing[i] - target[i] if end > 0.0 else 0.0
    for n in range(stage.substeps):
        for i in range(8):
            current[0, i] = target[i] + stage.lag_start * lag[i]
            current[1, i] = target[i] + stage.lag_middle * lag[i]
            lag[i] *= end
            current[2, i] = target[i] + lag[i]
        for i in range(10):
            before[i] = state[i]
        _runge_kutta(stage, machine, start + n * step, state, current, work)
        apply_stops(stage, before)
    for i in range(8):
        stage.flowing[i] = current[2, i]
    stage.sample += 1
