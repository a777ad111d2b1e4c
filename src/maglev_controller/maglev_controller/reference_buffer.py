"""The references that have arrived ahead of time, found by sample number."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from maglev_model.axes import FloatArray


class ReferenceBuffer:
    """Holds the newest ``capacity`` references in a ring; a sample number is its own place.

    ``position``, ``velocity``, ``acceleration`` have shape (capacity, 5), ``phase`` and ``segment``
    (capacity,); the row of a sample is what :meth:`find` returns. References come in order: one
    that is not newer than the newest is the first of another run, and what is held of the run
    before is forgotten. ``renewed`` says that this happened since the last sample was answered.
    """

    def __init__(self, capacity: int = 1024) -> None:
        self.capacity = capacity
        self.sequence: NDArray[np.int64] = np.full(capacity, -1, dtype=np.int64)
        self.phase: NDArray[np.uint8] = np.zeros(capacity, dtype=np.uint8)
        self.segment: NDArray[np.int64] = np.zeros(capacity, dtype=np.int64)
        self.position: FloatArray = np.zeros((capacity, 5))
        self.velocity: FloatArray = np.zeros((capacity, 5))
        self.acceleration: FloatArray = np.zeros((capacity, 5))
        self.newest = -1
        self.session = 0
        self.renewed = False

    def clear(self) -> None:
        """Forget everything."""
        self.sequence[:] = -1
        self.newest = -1
        self.renewed = False

    def stage_began_anew(self) -> None:
        """Forget the run before, unless the references of the new one are here already."""
        if not self.renewed:
            self.clear()

    def store(
        self,
        sequence: int,
        phase: int,
        segment: int,
        position: ArrayLike,
        velocity: ArrayLike,
        acceleration: ArrayLike,
        session: int = 0,
    ) -> None:
        """Keep the reference of one sample; arrays (5,) in output order, ``session`` its sender."""
        if sequence <= self.newest:
            self.clear()
            self.renewed = True
        row = sequence % self.capacity
        self.sequence[row] = sequence
        self.phase[row] = phase
        self.segment[row] = segment
        self.position[row] = position
        self.velocity[row] = velocity
        self.acceleration[row] = acceleration
        self.newest, self.session = sequence, session

    def at(self, row: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, velocity and acceleration (5,) of a row."""
        return self.position[row], self.velocity[row], self.acceleration[row]

    def find(self, sequence: int) -> int:
        """The row of a sample's reference, -1 when it has not arrived or is forgotten."""
        row = sequence % self.capacity
        return row if self.sequence[row] == sequence >= 0 else -1
