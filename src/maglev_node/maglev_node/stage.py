"""The stage contract: what a simulated and a real stage have in common. No ROS here."""

from __future__ import annotations

from typing import NamedTuple, Protocol

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
