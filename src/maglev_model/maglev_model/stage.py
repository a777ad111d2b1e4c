"""The stage contract: what a simulated and a real stage have in common. No ROS here."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class EncoderSample(NamedTuple):
    """What the six encoders read at one sample."""

    gap: FloatArray  # air gap at motors 1..4 [m], shape (4,)
    x: float  # displacement along X [m]
    z: float  # displacement along Z [m]


class StageError(RuntimeError):
    """The stage cannot go on; the message says why and what to do."""


class Stage(Protocol):
    """A stage that is read and written once a sample."""

    def read(self) -> EncoderSample:
        """The next sample's encoders; a real stage waits for its clock. Raises StageError."""
        ...

    def write(self, direct_current: FloatArray, quadrature_current: FloatArray) -> None:
        """Command i_d and i_q of motors 1..4 [A], held until the next write. Raises StageError."""
        ...

    def close(self) -> None:
        """Release everything with no current flowing; may be called twice."""
        ...


def motor_currents(name: str, value: Any) -> FloatArray:
    """Currents of motors 1..4 [A] as a contiguous array (4,); the same one where it is that.

    Raises ValueError, with ``name`` in it, for what is not four numbers.
    """
    if type(value) is np.ndarray and value.dtype == np.float64 and value.shape == (4,):
        return value
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f'{name} must be four numbers [A], not {value!r}') from error
    if array.shape != (4,):
        raise ValueError(f'{name} must have shape (4,), one current per motor, not {array.shape}')
    return np.ascontiguousarray(array)
