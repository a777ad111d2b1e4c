"""What samples by the thousand are looked at with: geometry (5) and phase currents, in NumPy."""

from __future__ import annotations

import numpy as np

from maglev_model.axes import PHI, THETA, FloatArray, X, Y, Z

_PHASE_SHIFTS = np.array([0.0, 2.0, 4.0]) * np.pi / 3.0


def motor_gaps(outputs: FloatArray, radius: float) -> FloatArray:
    """Air gaps g_1..g_4 [m], shape (..., 4), from outputs (..., 5) [m, rad], by (5).

    ``radius`` is r, from the centre of the platen to the centre of a mover [m].
    """
    gap = outputs[..., Y]
    tilt_phi = radius * np.sin(outputs[..., PHI])
    tilt_theta = radius * np.sin(outputs[..., THETA])
    return np.stack((gap - tilt_phi, gap + tilt_theta, gap + tilt_phi, gap - tilt_theta), axis=-1)


def outputs_of_gaps(
    gap: FloatArray, x: FloatArray | float, z: FloatArray | float, radius: float
) -> FloatArray:
    """Outputs y, x, z, phi, theta, shape (..., 5) [m, rad], from what encoders read: (5) inverted.

    ``gap`` (..., 4), ``x``, ``z`` (...) and ``radius`` r in [m]; y is the mean of the gaps. Gaps
    that no tilt can make give NaN tilts.
    """
    found = np.empty((*gap.shape[:-1], 5))
    found[..., Y] = gap.mean(axis=-1)
    found[..., X] = x
    found[..., Z] = z
    sines = (gap[..., (2, 1)] - gap[..., (0, 3)]) / (2.0 * radius)
    with np.errstate(invalid='ignore'):
        found[..., PHI:] = np.arcsin(sines)
    return found


def motor_phase_currents(
    direct_current: FloatArray,
    quadrature_current: FloatArray,
    x: FloatArray,
    z: FloatArray,
    pole_pitch: float,
) -> FloatArray:
    """Currents of the three phases of motors 1..4, shape (n, 4, 3) [A]: inverse Park, amplitudes.

    ``direct_current``, ``quadrature_current`` (n, 4) [A]; ``x``, ``z`` (n,) and ``pole_pitch`` tau
    in [m].
    """
    displacement = np.stack([z, x, z, x], axis=1)
    angle = (np.pi / pole_pitch * displacement)[:, :, None] - _PHASE_SHIFTS
    currents: FloatArray = direct_current[:, :, None] * np.cos(angle) - quadrature_current[
        :, :, None
    ] * np.sin(angle)
    return currents
