"""Axis order, and the air gaps at the four motors, (5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from maglev_model.axes import PHI, THETA, FloatArray, Y


def motor_gaps(position: FloatArray, radius: float) -> FloatArray:
    """Air gaps g_1..g_4 [m] from outputs y, x, z, phi, theta (..., 5) [m, rad], by (5).

    ``radius`` is r, from the centre of the platen to the centre of a mover [m]. Returns (..., 4).
    """
    gap = position[..., Y]
    lift_phi = radius * np.sin(position[..., PHI])
    lift_theta = radius * np.sin(position[..., THETA])
    return np.stack((gap - lift_phi, gap + lift_theta, gap + lift_phi, gap - lift_theta), axis=-1)


def outputs(gap: Sequence[float] | FloatArray, x: float, z: float, radius: float) -> FloatArray:
    """Outputs y, x, z, phi, theta (5,) [m, rad] from four air gaps, x and z [m]: (5) inverted.

    The four gaps of a rigid platen satisfy g_1 + g_3 = g_2 + g_4; where readings do not, y is their
    mean. Raises ValueError when a reading is not finite or no tilt explains the gaps.
    """
    g_1, g_2, g_3, g_4 = (float(value) for value in gap)
    found = np.array([0.25 * (g_1 + g_2 + g_3 + g_4), x, z, 0.0, 0.0])
    if not np.isfinite(found).all():
        raise ValueError(f'encoder readings are not finite: gaps {list(gap)}, x {x}, z {z}')
    sines = np.array([g_3 - g_1, g_2 - g_4]) / (2.0 * radius)
    if (np.abs(sines) > 1.0).any():
        raise ValueError(f'no tilt of the platen explains the gaps {list(gap)} m')
    found[PHI:] = np.arcsin(sines)
    return found
