"""The inverse by linearisation about an equilibrium: constant gains from w to currents.

At the equilibrium the platen is level at one air gap g and every motor carries a quarter of the
weight with the direct current i_d0. There (9) is, in deviations,
``ÿ = α_y δy + g_y δv_y``, ``φ̈ = α_φ φ + g_φ v_φ``, likewise θ, and ``ẍ = g_x u_x``, likewise z.
The gains g_y to g_z make the currents from w; the stiffness α is left to the compensator.
"""

from __future__ import annotations

import math

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.inverse import CURRENT, Answer, CurrentLimits, clip
from maglev_model.machine import Machine
from maglev_model.motor import attraction_coefficients


@borrowing
def equilibrium_current(machine: Machine, gap: float) -> float:
    """i_d0 [A] with which every motor carries a quarter of the weight at a gap [m], by (2)."""
    a, b, _ = attraction_coefficients(machine, gap)
    return (a - math.sqrt(0.25 * machine.M_y * machine.G)) / b


def stiffness(machine: Machine, gap: float) -> tuple[float, float, float, float, float]:
    """α of y, x, z, phi, theta [1/s²]: what (6), (7) give per deviation, at fixed currents."""
    i_d, step = equilibrium_current(machine, gap), 1e-6

    def attraction(gap: float) -> float:
        """Of one motor [N], without i_q, by (2)."""
        a, b, _ = attraction_coefficients(machine, gap)
        return (a - b * i_d) * (a - b * i_d)

    slope = (attraction(gap + step) - attraction(gap - step)) / (2.0 * step)
    tilt = -2.0 * machine.r**2 / machine.I_x * slope
    alpha_y = -4.0 * slope / machine.M_y
    return alpha_y, 0.0, 0.0, tilt - machine.k_s_phi, tilt - machine.k_s_theta


@borrowing
def equilibrium_inverse(
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    gap: float,
    wanted: FloatArray,
    answer: Answer,
) -> int:
    """Currents for w by the gains at the equilibrium ``gap`` [m], each limited by itself.

    The other arguments are those of the module ``inverse``.
    """
    direct, quadrature, realised, excess = answer
    _, b, h = attraction_coefficients(machine, gap)
    slope = b * math.sqrt(machine.M_y * machine.G)  # of a motor's pull over i_d, -∂P/∂i_d [N/A]
    bias = equilibrium_current(machine, gap)
    gain_y, gain_tilt = 2.0 * slope / machine.M_y, -slope * machine.r / machine.I_x
    h_x, h_z = -2.0 * h / machine.M_x, -2.0 * h / machine.M_z
    u_x, u_z = controlled[1] * wanted[1] / h_x, controlled[2] * wanted[2] / h_z
    sat_x, sat_z = clip(u_x, limits.current), clip(u_z, limits.current)
    v_y = controlled[0] * wanted[0] / gain_y
    v_phi = controlled[3] * wanted[3] / gain_tilt
    v_theta = controlled[4] * wanted[4] / gain_tilt
    parts = (v_phi, -v_theta, -v_phi, v_theta)  # (8)
    saturated = sat_x != u_x or sat_z != u_z
    for motor in range(4):
        unlimited = bias + 0.5 * (v_y + parts[motor])
        direct[motor] = clip(unlimited, limits.current)
        quadrature[motor] = sat_z if motor % 2 == 0 else sat_x
        saturated = saturated or direct[motor] != unlimited
    v_y = 0.5 * (direct[0] + direct[1] + direct[2] + direct[3]) - 2.0 * bias
    realised[0] = gain_y * v_y
    realised[1], realised[2] = h_x * sat_x, h_z * sat_z
    realised[3] = gain_tilt * (direct[0] - direct[2])
    realised[4] = gain_tilt * (direct[3] - direct[1])
    excess[0], excess[1] = sat_x - u_x, sat_z - u_z
    return CURRENT if saturated else 0
