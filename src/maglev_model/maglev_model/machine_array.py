"""The machine's constants as an array, which compiled functions take quickly from Python."""

from __future__ import annotations

from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_model.compiled import borrowing
from maglev_model.machine import Machine

FIELDS: Final = len(Machine._fields)

MachineArray = Annotated[NDArray[np.float64], FIELDS]
"""A field of a record that holds the constants."""


def machine_to_array(machine: Machine) -> NDArray[np.float64]:
    """The constants in one array, shape (20,), for :func:`machine_from_array`."""
    return np.array(machine, dtype=np.float64)


@borrowing
def _five(array: NDArray[np.float64], i: int) -> tuple[float, float, float, float, float]:
    return array[i], array[i + 1], array[i + 2], array[i + 3], array[i + 4]


@borrowing
def machine_from_array(array: NDArray[np.float64]) -> Machine:
    """The :class:`Machine` in an array; an array is the cheaper argument for calls from Python.

    Each element by itself: what a caller does not use costs nothing then, and the whole a hundredth
    of what Numba's own tuple of an array takes.
    """
    return Machine(*_five(array, 0), *_five(array, 5), *_five(array, 10), *_five(array, 15))
