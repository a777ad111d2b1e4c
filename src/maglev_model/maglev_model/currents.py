"""The currents of the exact inverse at many instants at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray
from maglev_model.compiled import compiled
from maglev_model.inverse import NO_LIMITS, Answer, CurrentLimits, exact_inverse
from maglev_model.machine import Machine


@compiled
def _all_currents(
    machine: Machine,
    limits: CurrentLimits,
    outputs: FloatArray,
    wanted: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
    possible: NDArray[np.bool_],
) -> None:
    controlled, realised, excess = np.ones(5), np.empty(5), np.empty(2)
    for k in range(outputs.shape[0]):
        answer = Answer(direct[k], quadrature[k], realised, excess)
        limited_by = exact_inverse(machine, limits, controlled, outputs[k], wanted[k], answer)
        possible[k] = limited_by == 0


def exact_currents(
    machine: Machine, outputs: FloatArray, wanted: FloatArray, limits: CurrentLimits = NO_LIMITS
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
    """The currents that :func:`~.inverse.exact_inverse` gives at n instants.

    ``outputs`` y, x, z, phi, theta [m, rad] and ``wanted`` accelerations [m/s², rad/s²], shape (n,
    5). Returns i_d and i_q of motors 1..4 [A], shape (n, 4), and whether they make the
    accelerations, shape (n,).
    """
    n = len(outputs)
    direct, quadrature = np.empty((n, 4)), np.empty((n, 4))
    possible = np.empty(n, dtype=np.bool_)
    outputs = np.ascontiguousarray(outputs, dtype=np.float64)
    wanted = np.ascontiguousarray(wanted, dtype=np.float64)
    _all_currents(machine, limits, outputs, wanted, direct, quadrature, possible)
    return direct, quadrature, possible
