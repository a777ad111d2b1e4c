"""The exact inverse for the machine with a single motor: air gap y and displacement x."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from maglev_model.compiled import compiled
from maglev_model.inverse import Limits
from maglev_model.machine import Machine
from maglev_model.motor import attraction_coefficients

FloatArray = NDArray[np.float64]


@compiled
def single_motor_inverse(
    machine: Machine,
    limits: Limits,
    controlled: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
    realised: FloatArray,
    excess: FloatArray,
) -> bool:
    """Motor 2 through the quadratic (2). See the module ``inverse`` for the arguments.

    ``F_V = M_y (w_y - G)`` and ``F_H = M_x w_x`` with ``F_V = -P``, ``P = (a - b i_d)² + b² i_q²``.
    When levitation comes first, i_q gets what the attraction leaves: ``b² i_q² ≤ P`` and i_d within
    the amplitude. The other motors get no current.
    """
    a, b, h = attraction_coefficients(machine, output[0])
    gain = -h / machine.M_x
    u_x = controlled[1] * wanted[1] / gain
    pull = machine.M_y * (machine.G - wanted[0]) if controlled[0] != 0.0 else a * a
    attraction = max(pull, limits.least_attraction * machine.M_y * machine.G)
    limit = limits.current
    if limits.levitation_first != 0.0:
        root = max((a * a + attraction - (limit * b) ** 2) / (2.0 * a), 0.0)
        limit = min(limit, math.sqrt(max(attraction - root * root, 0.0)) / b)
    i_q = min(max(u_x, -limit), limit)
    square = attraction - (b * i_q) ** 2
    i_d = (a - math.sqrt(max(square, 0.0))) / b
    bound = limits.current
    if limits.levitation_first != 0.0:
        bound = math.sqrt(max(bound * bound - i_q * i_q, 0.0)) * (1.0 + 1e-12)
    limited = min(max(i_d, -bound), bound)
    for motor in range(4):
        direct[motor] = limited if motor == 1 else 0.0
        quadrature[motor] = i_q if motor == 1 else 0.0
    made = (a - b * limited) ** 2 + (b * i_q) ** 2
    for axis in range(5):
        realised[axis] = 0.0
    realised[0], realised[1] = machine.G - made / machine.M_y, gain * i_q
    excess[0], excess[1] = i_q - u_x, 0.0
    missed = abs(made - pull) > 1e-6 * machine.M_y * machine.G
    return bool(missed or i_q != u_x)
