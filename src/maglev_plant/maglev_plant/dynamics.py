"""One sample of the stage: amplifiers, platen with friction, locks and disturbances, stops."""

from __future__ import annotations

import math

import numpy as np

from maglev_model.compiled import compiled
from maglev_model.machine import Machine, machine_from_array
from maglev_model.platen import output_accelerations
from maglev_plant.amplifier import set_targets
from maglev_plant.arrays import (
    AMPLITUDE,
    ANGULAR_FREQUENCY,
    CONSTANT,
    COULOMB,
    COULOMB_VELOCITY,
    FLOWING,
    LAG_END,
    LAG_MIDDLE,
    LAG_START,
    LOCKED,
    PHASE,
    SAMPLE,
    SINUSOIDS,
    STATE,
    STEP,
    SUBSTEPS,
    TARGET,
    VISCOUS,
    FloatArray,
)
from maglev_plant.stops import apply_stops


@compiled
def derivative(
    scalars: FloatArray,
    axes: FloatArray,
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
    rate[1], rate[3], rate[5], rate[7], rate[9] = output_accelerations(
        machine, state[0], state[6], state[8], current[:4], current[4:]
    )
    for axis in range(5):
        velocity = state[2 * axis + 1]
        total = rate[2 * axis + 1] + axes[CONSTANT, axis] - axes[VISCOUS, axis] * velocity
        if axes[COULOMB, axis] > 0.0:
            total -= axes[COULOMB, axis] * math.tanh(velocity / axes[COULOMB_VELOCITY, axis])
        if scalars[SINUSOIDS] > 0.0:
            angle = axes[ANGULAR_FREQUENCY, axis] * time + axes[PHASE, axis]
            total += axes[AMPLITUDE, axis] * math.sin(angle)
        free = axes[LOCKED, axis] == 0.0
        rate[2 * axis] = velocity if free else 0.0
        rate[2 * axis + 1] = total if free else 0.0


@compiled
def _blend(state: FloatArray, rate: FloatArray, step: float, out: FloatArray) -> None:
    for i in range(10):
        out[i] = state[i] + step * rate[i]


@compiled
def _runge_kutta(
    scalars: FloatArray,
    axes: FloatArray,
    machine: Machine,
    time: float,
    state: FloatArray,
    current: FloatArray,
    work: FloatArray,
) -> None:
    """One free step of ``state`` by the classical method; ``current`` at its start, middle, end."""
    step = scalars[STEP]
    k_1, k_2, k_3, k_4, probe = work[0], work[1], work[2], work[3], work[4]
    middle = time + 0.5 * step
    derivative(scalars, axes, machine, time, state, current[0], k_1)
    _blend(state, k_1, 0.5 * step, probe)
    derivative(scalars, axes, machine, middle, probe, current[1], k_2)
    _blend(state, k_2, 0.5 * step, probe)
    derivative(scalars, axes, machine, middle, probe, current[1], k_3)
    _blend(state, k_3, step, probe)
    derivative(scalars, axes, machine, time + step, probe, current[2], k_4)
    for i in range(10):
        state[i] += step / 6.0 * (k_1[i] + 2.0 * (k_2[i] + k_3[i]) + k_4[i])


@compiled
def advance(scalars: FloatArray, axes: FloatArray, memory: FloatArray, command: FloatArray) -> None:
    """Carry ``memory`` over one sample with the commanded currents held.

    Takes the fields of :class:`~maglev_plant.arrays.StageArrays`; callable from compiled loops.
    ``command`` must be finite.
    """
    machine = machine_from_array(scalars)
    set_targets(scalars, machine, memory, command)
    step, end = scalars[STEP], scalars[LAG_END]
    substeps = int(scalars[SUBSTEPS])
    start = memory[SAMPLE] * (step * substeps)
    state = memory[STATE : STATE + 10]
    target = memory[TARGET : TARGET + 8]
    lag = memory[FLOWING : FLOWING + 8] - target if end > 0.0 else np.zeros(8)
    current = np.empty((3, 8))
    work = np.empty((6, 10))
    before = work[5]
    for n in range(substeps):
        for i in range(8):
            current[0, i] = target[i] + scalars[LAG_START] * lag[i]
            current[1, i] = target[i] + scalars[LAG_MIDDLE] * lag[i]
            lag[i] *= end
            current[2, i] = target[i] + lag[i]
        before[:] = state
        _runge_kutta(scalars, axes, machine, start + n * step, state, current, work)
        apply_stops(scalars, axes, memory, before, step)
    memory[FLOWING : FLOWING + 8] = current[2]
    memory[SAMPLE] += 1.0
