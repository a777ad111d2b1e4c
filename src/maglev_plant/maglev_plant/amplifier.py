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
from maglev_model.compiled import borrowing
from maglev_model.machine import Machine
from maglev_plant.arrays import StageArrays


@borrowing
def limit_phase(stage: StageArrays, phase: int, current: float) -> float:
    """Clip one phase's current [A] to what its amplifier can give now, and heat it for a sample."""
    load = stage.load[phase]
    if load >= 1.0:
        stage.limited[phase] = 1
    elif load < stage.thermal_recovery:
        stage.limited[phase] = 0
    limit = stage.continuous if stage.limited[phase] else stage.peak
    current = min(max(current, -limit), limit)
    ratio = current / stage.continuous
    stage.load[phase] = load + stage.thermal_gain * (ratio * ratio - load)
    return current


@borrowing
def set_targets(stage: StageArrays, machine: Machine) -> None:
    """Write what the amplifiers aim at for one sample, from the commanded currents."""
    for first in range(2):  # opposite motors have one angle
        angle = electrical_angle(machine, stage.state[2] if first else stage.state[4])
        for motor in range(first, 4, 2):
            wanted_d, wanted_q = stage.command[motor], stage.command[4 + motor]
            want_a, want_b, want_c = phase_currents(wanted_d, wanted_q, angle)
            a = limit_phase(stage, 3 * motor, want_a)
            b = limit_phase(stage, 3 * motor + 1, want_b)
            c = limit_phase(stage, 3 * motor + 2, want_c)
            if a != want_a or b != want_b or c != want_c:
                wanted_d, wanted_q = direct_quadrature_currents(a, b, c, angle)
            stage.target[motor] = wanted_d
            stage.target[4 + motor] = wanted_q
