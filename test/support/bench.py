"""A regulator on the bench: fed by hand, a sample at a time."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator

HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
ZERO = np.zeros(5)


class Bench:
    """A regulator with its outputs, fed by hand."""

    def __init__(self, parameters: ControllerParameters | None = None) -> None:
        self.regulator = Regulator(parameters or ControllerParameters())
        self.direct, self.quadrature = np.full(4, 9.0), np.full(4, 9.0)

    def step(
        self,
        gap: ArrayLike = 0.025,
        x: float = 0.0,
        z: float = 0.0,
        position: np.ndarray = HOVER,
        velocity: np.ndarray = ZERO,
        acceleration: np.ndarray = ZERO,
    ) -> bool:
        """One sample; ``gap`` one for all motors or four."""
        gaps = np.broadcast_to(np.asarray(gap, dtype=float), (4,)).copy()
        return self.regulator.step(
            gaps, x, z, position, velocity, acceleration, self.direct, self.quadrature
        )

    @property
    def currents(self) -> np.ndarray:
        """i_d and i_q last commanded, a copy."""
        return np.concatenate((self.direct, self.quadrature))
