"""The inverse of a controller's parameters as a function: from outputs and w to currents."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.arrays import EXACT, INVERSES, SIMPLIFIED
from maglev_model.axes import FloatArray
from maglev_model.equilibrium import equilibrium_inverse
from maglev_model.inverse import Answer, CurrentLimits, exact_inverse, simplified_inverse
from maglev_model.machine import Machine, machine_constants


def inverse_of(
    controller: ControllerParameters, limits: CurrentLimits
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    """The function: outputs (5,) [m, rad] and accelerations w (5,) to i_d, then i_q, (8,) [A]."""
    machine, inverse = machine_constants(controller.machine), INVERSES.index(controller.inverse)
    controlled = np.array([float(axis.controlled) for axis in controller.axes])
    return partial(
        _currents, inverse, machine, limits, controlled, controller.compensator.equilibrium
    )


def _currents(
    inverse: int,
    machine: Machine,
    limits: CurrentLimits,
    controlled: FloatArray,
    equilibrium: float,
    output: FloatArray,
    wanted: FloatArray,
) -> FloatArray:
    found = np.zeros(8)
    answer = Answer(found[:4], found[4:], np.empty(5), np.empty(2))
    if inverse == EXACT:
        exact_inverse(machine, limits, controlled, output, wanted, answer)
    elif inverse == SIMPLIFIED:
        simplified_inverse(machine, limits, controlled, output, wanted, answer)
    else:
        equilibrium_inverse(machine, limits, controlled, equilibrium, wanted, answer)
    return found
