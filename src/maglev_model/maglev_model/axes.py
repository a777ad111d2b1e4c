"""The outputs and their order, the same everywhere: air gap, two displacements, two tilts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

AXES = ('y', 'x', 'z', 'phi', 'theta')
UNITS = ('m', 'm', 'm', 'rad', 'rad')
Y, X, Z, PHI, THETA = range(5)
