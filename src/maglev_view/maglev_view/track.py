"""The path of a point, thinned. No ROS here."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from maglev_view.frames import Vector

T = TypeVar('T')


class Track(Generic[T]):
    """What stands for the last points of a path, no two in a row nearer than ``step`` [m].

    :param longest: how many points it has at most.
    """

    def __init__(self, longest: int, step: float) -> None:
        self.points: deque[T] = deque(maxlen=longest)
        self._last: Vector | None = None
        self._least = step * step

    def add(self, where: Vector, make: Callable[[], T]) -> bool:
        """Take a point [m] if it is far enough from the last one; whether it is."""
        if self._last is not None and _square(where, self._last) < self._least:
            return False
        self._last = where
        self.points.append(make())
        return True


def _square(a: Vector, b: Vector) -> float:
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
