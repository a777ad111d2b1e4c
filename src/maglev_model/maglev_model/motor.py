"""Forces of one iron-cored linear synchronous motor, (1)-(4), as compiled functions of its air gap.

The fields of magnets and winding superpose, so the attraction is a perfect square plus the part of
the quadrature current: ``F_V = -(a - b·i_d)² - b²·i_q²`` with ``a² = K_v1·L_v1`` and
``b² = K_v3·L_v3``. Forces act on the mover; vertical ones are positive downward, where they widen
the gap, as in the paper.
"""

from __future__ import annotations

import math

import numpy as np

from maglev_model.axes import FloatArray
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


@borrowing
def gap_functions(machine: Machine, gap: float) -> tuple[float, float, float, float]:
    """``L_v1, L_v2, L_v3, L_h`` at one gap [m] from one evaluation of what they share."""
    e = math.exp(math.pi / machine.tau * (machine.h_m + gap))
    sinh = 0.5 * (e - 1.0 / e)
    coth = 0.5 * (e + 1.0 / e) / sinh
    u = machine.b_0 / (2.0 * gap)
    gamma_1 = 4.0 / math.pi * (u * math.atan(u) - 0.5 * math.log(1.0 + u * u))
    winding = coth * (1.0 - gap * gamma_1 / machine.t_1)  # coth / K_c
    magnet = machine.B_0 / sinh  # B_pmy1
    permeance = slot_permeance(machine, gap)
    return (
        permeance * magnet * magnet,
        permeance * magnet * winding,
        permeance * winding * winding,
        permeance * winding / (coth * sinh),
    )


@borrowing
def force_coefficients(machine: Machine, gap: float) -> tuple[float, float, float, float]:
    """What multiplies the currents at one gap [m]: ``k_1``, ``k_2``, ``k_3``, ``k_h``.

    ``K_v1·L_v1`` [N], ``K_v2·L_v2`` [N/A], ``K_v3·L_v3`` [N/A²] and ``K_h·L_h`` [N/A]. Then
    ``F_V = -k_1 + k_2·i_d - k_3·(i_d² + i_q²)`` and ``F_H = -k_h·i_q``, (1), (2).
    """
    l_v1, l_v2, l_v3, l_h = gap_functions(machine, gap)
    return machine.K_v1 * l_v1, machine.K_v2 * l_v2, machine.K_v3 * l_v3, machine.K_h * l_h


@borrowing
def forces_of_currents(
    coefficients: tuple[float, float, float, float], i_d: float, i_q: float
) -> tuple[float, float]:
    """F_V and F_H [N], (1), (2), of ``i_d``, ``i_q`` [A] and the :func:`force_coefficients`."""
    k_1, k_2, k_3, k_h = coefficients
    return -k_1 + k_2 * i_d - k_3 * (i_d * i_d + i_q * i_q), -k_h * i_q


@borrowing
def attraction_coefficients(machine: Machine, gap: float) -> tuple[float, float, float]:
    """``a = √(K_v1·L_v1)`` [√N], ``b = √(K_v3·L_v3)`` [√N/A] and ``K_h·L_h`` [N/A] at one gap [m].

    ``K_v2·L_v2 = 2ab`` for a machine whose K's come from Table I, so that
    ``F_V = -(a - b·i_d)² - b²·i_q²``.
    """
    k_1, _, k_3, k_h = force_coefficients(machine, gap)
    return math.sqrt(k_1), math.sqrt(k_3), k_h


def inductances(gaps: FloatArray, k_3: FloatArray, gap: float, there: float) -> FloatArray:
    """L [H] of a phase at rising ``gaps`` (n,) [m], which is ``there`` at ``gap``.

    By co-energy ``dL/dg = -(4/3) K_v3 L_v3``, with ``k_3`` (n,) of :func:`force_coefficients`; but
    never below a tenth of ``there``.
    """
    slope = -4.0 / 3.0 * k_3
    rise = np.concatenate(([0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(gaps))))
    return np.maximum(there + rise - np.interp(gap, gaps, rise), 0.1 * there)
