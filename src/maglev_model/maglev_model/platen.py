"""Geometry (5) and dynamics (6), (7), (9) of the platen, as compiled functions.

Outputs are y, x, z, phi, theta. Motors 1 and 3 lie along Z (phi, u_z),
motors 2 and 4 along X (theta, u_x). Every motor has its own two currents; the paper's u_x is the
i_q of 2 and 4, its u_z that of 1 and 3.
"""

from __future__ import annotations

import math

from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.machine import Machine
from maglev_model.motor import force_coefficients, forces_of_currents


@borrowing
def motor_gaps(
    machine: Machine, y: float, phi: float, theta: float
) -> tuple[float, float, float, float]:
    """Air gaps of the motors [m] by (5); of a single motor, ``y`` is its own."""
    tilt_phi = machine.r * math.sin(phi)
    tilt_theta = machine.r * math.sin(theta) if machine.motors != 1.0 else 0.0
    return y - tilt_phi, y + tilt_theta, y + tilt_phi, y - tilt_theta


@borrowing
def gaps_from_outputs(machine: Machine, output: FloatArray, gap: FloatArray) -> None:
    """Air gaps of the motors by (5).

    ``output`` y, x, z, phi, theta [m, rad], shape (5,); ``gap`` [m], shape (4,), is written.
    """
    gap[0], gap[1], gap[2], gap[3] = motor_gaps(machine, output[0], output[3], output[4])


@borrowing
def outputs_from_gaps(
    machine: Machine, gap: FloatArray, x: float, z: float, output: FloatArray
) -> float:
    """Outputs from what the encoders read: (5) inverted exactly, y as the mean of the gaps.

    ``gap`` [m], shape (4,), ``x`` and ``z`` [m]; ``output`` y, x, z, phi, theta [m, rad], shape
    (5,), is written. Returns ``g_1 + g_3 - g_2 - g_4`` [m], which is zero for a rigid platen. Gaps
    that no tilt can make give NaN.
    """
    sin_phi = (gap[2] - gap[0]) / (2.0 * machine.r)
    sin_theta = (gap[1] - gap[3]) / (2.0 * machine.r)
    output[0] = 0.25 * (gap[0] + gap[1] + gap[2] + gap[3])
    output[1] = x
    output[2] = z
    output[3] = math.asin(sin_phi) if abs(sin_phi) <= 1.0 else math.nan
    output[4] = math.asin(sin_theta) if abs(sin_theta) <= 1.0 else math.nan
    return float(gap[0] + gap[2] - gap[1] - gap[3])


@borrowing
def _motor_forces(machine: Machine, gap: float, i_d: float, i_q: float) -> tuple[float, float]:
    """F_V and F_H of one motor [N], (1), (2)."""
    return forces_of_currents(force_coefficients(machine, gap), i_d, i_q)


@borrowing
def balance(
    machine: Machine,
    phi: float,
    theta: float,
    vertical: tuple[float, float, float, float],
    horizontal: tuple[float, float, float, float],
) -> tuple[float, float, float, float, float]:
    """Accelerations of y, x, z, phi, theta [m/s², rad/s²] by (6), (7), from the motors' forces [N].

    Of a machine with a single motor, which is motor 2, only y and x move.
    """
    v_1, v_2, v_3, v_4 = vertical
    h_1, h_2, h_3, h_4 = horizontal
    if machine.motors == 1.0:
        return machine.G + v_2 / machine.M_y, h_2 / machine.M_x, 0.0, 0.0, 0.0
    lever = machine.k_rot / machine.M_y
    return (
        machine.G + (v_1 + v_2 + v_3 + v_4) / machine.M_y,
        (h_2 + h_4) / machine.M_x,
        (h_1 + h_3) / machine.M_z,
        lever * (v_3 - v_1) - machine.k_s_phi * phi,
        lever * (v_2 - v_4) - machine.k_s_theta * theta,
    )


@borrowing
def output_accelerations(
    machine: Machine,
    y: float,
    phi: float,
    theta: float,
    i_d: FloatArray,
    i_q: FloatArray,
) -> tuple[float, float, float, float, float]:
    """Accelerations of y, x, z, phi, theta [m/s², rad/s²] by (6), (7), from what they depend on.

    ``y`` [m], ``phi``, ``theta`` [rad]; ``i_d``, ``i_q`` [A], shape (4,). Of a machine with a
    single motor, only y and x move. No friction, no stops: the bare platen.
    """
    g_1, g_2, g_3, g_4 = motor_gaps(machine, y, phi, theta)
    v_1, h_1 = _motor_forces(machine, g_1, i_d[0], i_q[0])
    v_2, h_2 = _motor_forces(machine, g_2, i_d[1], i_q[1])
    v_3, h_3 = _motor_forces(machine, g_3, i_d[2], i_q[2])
    v_4, h_4 = _motor_forces(machine, g_4, i_d[3], i_q[3])
    return balance(machine, phi, theta, (v_1, v_2, v_3, v_4), (h_1, h_2, h_3, h_4))


@borrowing
def affine_terms(
    machine: Machine,
    y: float,
    phi: float,
    theta: float,
    u_x: float,
    u_z: float,
    a: FloatArray,
    b: FloatArray,
    c: FloatArray,
) -> None:
    """The terms of (9), in the paper's order: ``a[0]`` is a_1, and so on.

    ``y`` [m], ``phi``, ``theta`` [rad], ``u_x``, ``u_z`` [A]. Written: ``a``, shape (9,), in m/s²
    and its quotients by A and A²; ``b`` and ``c``, shape (6,), likewise in rad/s². They multiply
    a: 1, v_phi, v_y, v_phi·v_y, v_phi², v_y², v_theta, v_y·v_theta, v_theta²;
    b: 1, v_phi, v_y, v_phi·v_y, v_phi², v_y²; c: 1, v_theta, v_y, v_y·v_theta, v_theta², v_y².
    """
    g_1, g_2, g_3, g_4 = motor_gaps(machine, y, phi, theta)
    p_1, q_1, s_1, _ = force_coefficients(machine, g_1)
    p_2, q_2, s_2, _ = force_coefficients(machine, g_2)
    p_3, q_3, s_3, _ = force_coefficients(machine, g_3)
    p_4, q_4, s_4, _ = force_coefficients(machine, g_4)
    per_mass = 1.0 / machine.M_y
    lever = machine.k_rot / machine.M_y
    u_x2 = u_x * u_x
    u_z2 = u_z * u_z
    attraction = p_1 + p_2 + p_3 + p_4 + (s_1 + s_3) * u_z2 + (s_2 + s_4) * u_x2
    a[0] = machine.G - per_mass * attraction
    a[1] = 0.5 * per_mass * (q_1 - q_3)
    a[2] = 0.5 * per_mass * (q_1 + q_2 + q_3 + q_4)
    a[3] = 0.5 * per_mass * (s_3 - s_1)
    a[4] = -0.25 * per_mass * (s_1 + s_3)
    a[5] = -0.25 * per_mass * (s_1 + s_2 + s_3 + s_4)
    a[6] = 0.5 * per_mass * (q_4 - q_2)
    a[7] = 0.5 * per_mass * (s_2 - s_4)
    a[8] = -0.25 * per_mass * (s_2 + s_4)
    b[0] = lever * (p_1 - p_3 + (s_1 - s_3) * u_z2) - machine.k_s_phi * phi
    b[1] = -0.5 * lever * (q_1 + q_3)
    b[2] = 0.5 * lever * (q_3 - q_1)
    b[3] = 0.5 * lever * (s_1 + s_3)
    b[4] = 0.25 * lever * (s_1 - s_3)
    b[5] = b[4]
    c[0] = lever * (p_4 - p_2 + (s_4 - s_2) * u_x2) - machine.k_s_theta * theta
    c[1] = -0.5 * lever * (q_2 + q_4)
    c[2] = 0.5 * lever * (q_2 - q_4)
    c[3] = 0.5 * lever * (s_2 + s_4)
    c[4] = 0.25 * lever * (s_4 - s_2)
    c[5] = c[4]
