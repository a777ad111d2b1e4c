"""What the guard of the encoders knows, and what an encoder can be to it."""

from __future__ import annotations

from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.sensing.observer import ObserverArrays
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing

# What an encoder is.
SOUND: Final = 0
PUT_RIGHT: Final = 1  # after a slip
LOST: Final = 2
NOISY: Final = 3  # x and z that both leap again and again: better than nothing


class GuardArrays(ObserverArrays):
    """What :func:`watch` takes: bounds, and what it has seen; lengths are gaps 1..4, x, z [m]."""

    max_jump: float  # [m]
    max_residual: float  # [m]
    max_unseen: Annotated[FloatArray, 6]  # [m]
    roll_call: float  # [m]
    gap_lower: float  # [m]
    gap_upper: float  # [m]
    soft_lower: Annotated[FloatArray, 5]  # y, x, z, phi, theta [m, rad]
    soft_upper: Annotated[FloatArray, 5]
    max_unexplained: Annotated[FloatArray, 5]  # [m/s², rad/s²]
    settling: int  # samples until the disturbance is found
    on_probation: int  # samples after a slip
    unexplainable: int  # samples in a row with too large a disturbance that are a fault
    at_once: Annotated[FloatArray, 6]  # 1 where an encoder is read at once, 0: at the tick

    trust: Annotated[NDArray[np.int8], 6]  # SOUND, PUT_RIGHT, LOST or NOISY
    probation: Annotated[NDArray[np.int64], 6]  # samples that a slip is not followed yet
    offset: Annotated[FloatArray, 6]  # what an encoder reads too much [m]
    blamed: Annotated[NDArray[np.int8], 6]  # found wrong in this sample
    samples: int  # seen
    expected: Annotated[FloatArray, 6]  # read right before the first; not a number: not known [m]
    contradictions: int  # samples in a row with too large a residual
    unexplained: Annotated[NDArray[np.int64], 5]  # samples in a row with too large a disturbance
    residual: float  # g1 + g3 - g2 - g4 as it is read [m]
    believed: Annotated[FloatArray, 6]  # lengths, put right or by the observer
    past: Annotated[FloatArray, 2, 6]  # believed lengths of the last sample and the one before
    slip: Annotated[FloatArray, 6]  # what was put right last [m]
    rigid: bool  # whether four believed gaps must be those of a rigid platen
    residual_then: Annotated[FloatArray, 4]  # when a gap encoder counted last [m]
    still: Annotated[NDArray[np.int64], 4]  # and samples since
    unseen: Annotated[FloatArray, 6]  # how far it should have moved at least since its last count
    silent: Annotated[NDArray[np.int64], 6]  # samples in flight in which it has not counted
    stood: Annotated[NDArray[np.int8], 2]  # 1 where x, z are lost because they stood still
    read: Annotated[FloatArray, 2]  # by x, z in the last sample, believed or not [m]
    heard: Annotated[NDArray[np.int64], 2]  # counts one way since they are lost, signed
    returned: bool  # whether x or z is believed again since this sample
    answered: Annotated[NDArray[np.int8], 4]  # gaps that have counted since the platen rested
    left: Annotated[FloatArray, 4]  # and by how much, leaps aside [m]


@borrowing
def gap_residual(length: FloatArray) -> float:
    """``g1 + g3 - g2 - g4``, which is 0 for a rigid platen [m]."""
    return float(length[0] + length[2] - length[1] - length[3])
