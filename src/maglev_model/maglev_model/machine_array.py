"""The machine's constants as an array, which compiled functions take quickly from Python."""

from __future__ import annotations

from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_model.compiled import borrowing, to_fixed_tuple
from maglev_model.machine import Machine

FIELDS: Final = len(Machine._fields)

MachineArray = Annotated[NDArray[np.float64], FIELDS]
"""A field of a record that holds the constants."""


def machine_to_array(machine: Machine) -> NDArray[np.float64]:
    """The constants in one array, shape (25,), for :func:`machine_from_array`."""
    return np.array(machine, dtype=np.float64)


@borrowing
def machine_from_array(array: NDArray[np.float64]) -> Machine:
    """The :class:`Machine` in an array; an array is the cheaper argument for calls from Python."""
    return Machine(*to_fixed_tuple(array, FIELDS))
