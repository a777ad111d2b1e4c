"""Park's transformation between a motor's direct and quadrature currents and its three phases.

The electrical angle is π·s/τ, with s the motor's own displacement: x for motors 2 and 4, z for 1
and 3. The length of (i_d, i_q) is the amplitude of the phase currents.
"""

from __future__ import annotations

import math

from maglev_model.compiled import borrowing
from maglev_model.machine import Machine

_SIN_120 = math.sqrt(3.0) / 2.0


@borrowing
def electrical_angle(machine: Machine, displacement: float) -> float:
    """Electrical angle [rad] of a motor displaced by ``displacement`` [m] along its axis."""
    return math.pi * displacement / machine.tau


@borrowing
def phase_currents(i_d: float, i_q: float, angle: float) -> tuple[float, float, float]:
    """Phase currents [A] from ``i_d``, ``i_q`` [A] at ``angle`` [rad]: inverse Park."""
    cos, sin = math.cos(angle), math.sin(angle)
    alpha = i_d * cos - i_q * sin
    beta = i_d * sin + i_q * cos
    return alpha, -0.5 * alpha + _SIN_120 * beta, -0.5 * alpha - _SIN_120 * beta


@borrowing
def direct_quadrature_currents(
    i_a: float, i_b: float, i_c: float, angle: float
) -> tuple[float, float]:
    """``i_d``, ``i_q`` [A] from the phase currents [A] at ``angle`` [rad]: Park.

    What the three phases have in common makes no travelling field and drops out.
    """
    cos, sin = math.cos(angle), math.sin(angle)
    alpha = (2.0 * i_a - i_b - i_c) / 3.0
    beta = (i_b - i_c) / (2.0 * _SIN_120)
    return alpha * cos + beta * sin, beta * cos - alpha * sin
