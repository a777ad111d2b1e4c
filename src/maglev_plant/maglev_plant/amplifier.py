"""Three-phase amplifiers: the peak of every phase, and the heat it may carry.

A phase's thermal load follows (current / continuous rating)² with a time constant, so the
continuous rating carried for ever brings it to 1. There the budget is spent and the phase is
clipped to the continuous rating until the load has recovered. What clipping leaves of the phases is
transformed back: a quadrature current beyond the peak costs direct current, as in the machine.
"""

from __future__ import annotations

from maglev_model.commutation import (
    direct_quadrature_currents,
    electrical_angle,
    phase_currents,
)
from maglev_model.compiled import compiled
from maglev_model.machine import Machine
from maglev_plant.arrays import (
    CONTINUOUS,
    DQ_SCALE,
    LIMITED,
    LOAD,
    PEAK,
    STATE,
    TARGET,
    THERMAL_GAIN,
    THERMAL_RECOVERY,
    FloatArray,
)


@compiled
def _limit_phase(scalars: FloatArray, memory: FloatArray, phase: int, current: float) -> float:
    """Clip one phase's current [A] to what its amplifier can give now, and heat it for a sample."""
    load = memory[LOAD + phase]
    if load >= 1.0:
        memory[LIMITED + phase] = 1.0
    elif load < scalars[THERMAL_RECOVERY]:
        memory[LIMITED + phase] = 0.0
    limit = scalars[CONTINUOUS] if memory[LIMITED + phase] > 0.0 else scalars[PEAK]
    current = min(max(current, -limit), limit)
    ratio = current / scalars[CONTINUOUS]
    memory[LOAD + phase] = load + scalars[THERMAL_GAIN] * (ratio * ratio - load)
    return current


@compiled
def set_targets(
    scalars: FloatArray, machine: Machine, memory: FloatArray, command: FloatArray
) -> None:
    """Write into ``memory`` what the amplifiers aim at for one sample, from the commanded currents.

    ``command``: i_d of motors 1..4, then i_q [A], shape (8,).
    """
    scale = scalars[DQ_SCALE]
    for motor in range(4):
        displacement = memory[STATE + 4] if motor % 2 == 0 else memory[STATE + 2]
        angle = electrical_angle(machine, displacement)
        wanted_d, wanted_q = command[motor], command[4 + motor]
        want_a, want_b, want_c = phase_currents(wanted_d, wanted_q, angle, scale)
        a = _limit_phase(scalars, memory, 3 * motor, want_a)
        b = _limit_phase(scalars, memory, 3 * motor + 1, want_b)
        c = _limit_phase(scalars, memory, 3 * motor + 2, want_c)
        if a != want_a or b != want_b or c != want_c:
            wanted_d, wanted_q = direct_quadrature_currents(a, b, c, angle, scale)
        memory[TARGET + motor] = wanted_d
        memory[TARGET + 4 + motor] = wanted_q
