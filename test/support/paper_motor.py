"""Forces of one motor, (1)-(4), each function as printed; the model has them in one pass."""

from __future__ import annotations

import math

from maglev_model.compiled import borrowing
from maglev_model.machine import Machine


@borrowing
def slot_factor(machine: Machine, gap: float) -> float:
    """Factor ``γ_1(g)`` of (4), without unit; ``gap`` [m]."""
    u = machine.b_0 / (2.0 * gap)
    return 4.0 / math.pi * (u * math.atan(u) - 0.5 * math.log(1.0 + u * u))


@borrowing
def carter_coefficient(machine: Machine, gap: float) -> float:
    """Carter's coefficient ``K_c(g)`` of (4), without unit; ``gap`` [m]."""
    return machine.t_1 / (machine.t_1 - gap * slot_factor(machine, gap))


@borrowing
def slot_permeance(machine: Machine, gap: float) -> float:
    """Relative permeance ``λ̃(g)`` of the slotted stator, (4), without unit; ``gap`` [m]."""
    depth = gap + machine.b_0 / 2.0 + machine.h_m / machine.mu_rec
    return 1.0 - machine.b_0**2 / (4.0 * machine.t_1 * depth)


@borrowing
def magnet_field(machine: Machine, gap: float) -> float:
    """The magnets' field at the stator ``B_pmy1(g)`` [T]; ``gap`` [m]."""
    return machine.B_0 / math.sinh(math.pi / machine.tau * (machine.h_m + gap))


@borrowing
def L_v1(machine: Machine, gap: float) -> float:  # noqa: N802
    """``L_v1(g)`` of (3) [T²]; ``gap`` [m]."""
    return slot_permeance(machine, gap) * magnet_field(machine, gap) ** 2


@borrowing
def L_v2(machine: Machine, gap: float) -> float:  # noqa: N802
    """``L_v2(g)`` of (3) [T]; ``gap`` [m]."""
    coth = 1.0 / math.tanh(math.pi / machine.tau * (machine.h_m + gap))
    field = slot_permeance(machine, gap) * magnet_field(machine, gap)
    return field * coth / carter_coefficient(machine, gap)


@borrowing
def L_v3(machine: Machine, gap: float) -> float:  # noqa: N802
    """``L_v3(g)`` of (3), without unit; ``gap`` [m]."""
    coth = 1.0 / math.tanh(math.pi / machine.tau * (machine.h_m + gap))
    return slot_permeance(machine, gap) * (coth / carter_coefficient(machine, gap)) ** 2


@borrowing
def L_h(machine: Machine, gap: float) -> float:  # noqa: N802
    """``L_h(g)`` of (4), without unit; ``gap`` [m]."""
    sinh = math.sinh(math.pi / machine.tau * (machine.h_m + gap))
    return slot_permeance(machine, gap) / (carter_coefficient(machine, gap) * sinh)


@borrowing
def horizontal_force(machine: Machine, gap: float, i_q: float) -> float:
    """Horizontal force ``F_H`` on the mover [N], (1); ``gap`` [m], ``i_q`` [A]."""
    return -machine.K_h * L_h(machine, gap) * i_q


@borrowing
def vertical_force(machine: Machine, gap: float, i_d: float, i_q: float) -> float:
    """Vertical force ``F_V`` on the mover [N], positive downward, (2); [m], [A]."""
    return (
        -machine.K_v1 * L_v1(machine, gap)
        + machine.K_v2 * L_v2(machine, gap) * i_d
        - machine.K_v3 * L_v3(machine, gap) * (i_d * i_d + i_q * i_q)
    )
