"""What is solved for, the same on every processor.

The last digits of what BLAS and LAPACK make are another processor's already, and of two flights
over counts that differ in these no count is the same for long.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from maglev_model.axes import FloatArray


def rounded(values: ArrayLike, digits: int) -> FloatArray:
    """``values`` of any shape with so many significant digits."""
    values = np.asarray(values, dtype=float)
    return np.array([float(f'{v:.{digits - 1}e}') for v in values.ravel()]).reshape(values.shape)
