"""What people give in place of what is meant: a dict, millimetres. Errors say what to write."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.machine import MachineParameters
from maglev_model.parameters import ParameterError

T = TypeVar('T')


def a_table(cls: type[T], given: T | None, name: str) -> T:
    """``given``, or the defaults for None. Raises TypeError for anything else, a dict above all."""
    if given is None:
        return cls()
    if isinstance(given, cls):
        return given
    if isinstance(given, dict):
        raise TypeError(
            f"'{name}' is a dict, it takes {cls.__name__}: maglev_model.parameters.build("
            f'{cls.__name__}, {{...}}) makes one of it'
        )
    raise TypeError(f"'{name}' is a {type(given).__name__}, it takes {cls.__name__}")


def positions(name: str, given: ArrayLike, machine: MachineParameters) -> FloatArray:
    """Positions y, x, z, phi, theta, (..., 5) [m, rad], within the machine's stops.

    Raises ValueError for another shape and for what is not finite, ParameterError beyond the stops,
    which says so where it looks like millimetres.
    """
    found = np.asarray(given, dtype=np.float64)
    if found.shape[-1:] != (5,):
        raise ValueError(f"'{name}' has shape {found.shape}, it takes (5,): {', '.join(AXES)}")
    if not np.isfinite(found).all():
        raise ValueError(f"'{name}' is {given!r}, it must be finite")
    lower, upper = np.array(machine.lower_limit), np.array(machine.upper_limit)
    outside = (found < lower - 1e-9) | (found > upper + 1e-9)
    if outside.any():
        place = tuple(np.argwhere(outside)[0])
        axis, value = int(place[-1]), float(found[place])
        unit, least, most = UNITS[axis], lower[axis], upper[axis]
        milli = least <= 1e-3 * value <= most
        hint = f', is it in m{unit}? {1e-3 * value:g} is' if milli else ''
        raise ParameterError(
            f"'{name}' puts {AXES[axis]} at {value:g} {unit}, it must lie within the stops, "
            f'[{least:g}, {most:g}] {unit}{hint}'
        )
    return found
