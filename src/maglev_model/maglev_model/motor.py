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
def force_coefficients(machine: Machine, gap: float) -> tuple[float, float, float, float]:
    """What multiplies the currents at one gap [m]: ``k_1``, ``k_2``, ``k_3``, ``k_h``.

    ``K_v1·L_v1`` [N], ``K_v2·L_v2`` [N/A], ``K_v3·L_v3`` [N/A²] and ``K_h·L_h`` [N/A], (3), (4),
    from one evaluation of what they share. Then
    ``F_V = -k_1 + k_2·i_d - k_3·(i_d² + i_q²)`` and ``F_H = -k_h·i_q``, (1), (2).
    """
    e = math.exp(math.pi / machine.tau * (machine.h_m + gap))
    sinh = 0.5 * (e - 1.0 / e)
    coth = 0.5 * (e + 1.0 / e) / sinh
    u = machine.b_0 / (2.0 * gap)
    gamma_1 = 4.0 / math.pi * (u * math.atan(u) - 0.5 * math.log(1.0 + u * u))
    winding = coth * (1.0 - gap * gamma_1 / machine.t_1)  # coth / K_c
    magnet = machine.B_0 / sinh  # B_pmy1 [T]
    depth = gap + machine.b_0 / 2.0 + machine.h_m / machine.mu_rec
    permeance = 1.0 - machine.b_0**2 / (4.0 * machine.t_1 * depth)  # λ̃
    return (
        machine.K_v1 * (permeance * magnet * magnet),
        machine.K_v2 * (permeance * magnet * winding),
        machine.K_v3 * (permeance * winding * winding),
        machine.K_h * (permeance * winding / (coth * sinh)),
    )


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
