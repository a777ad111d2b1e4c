"""The motors' electrical angles, from what their phases moved.

A phase pushes along with the sine of its electrical angle and up with the cosine, so what the
three of a motor moved, both ways round, tells the angle wherever it is. How far they moved is a
matter of friction as well: compared are square roots, for each motor as shares of the whole.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from maglev_hw_bridge.commissioning.response import Twins, angle_variants, friction_variants
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import FloatArray

MOTORS = 4
TOLERANCE = 0.2
"""What an angle may seem off by; on sound machines it is some 0.1 [rad]."""

_NEAR = 0.35  # about the angle that is believed in [rad]
_TURNS = 12  # of the circle
_LIKE = 0.75  # what less resembles is not explained by an angle


class Angles(NamedTuple):
    """Of the four motors, against what is believed."""

    off: FloatArray  # (4,) [rad]
    likeness: FloatArray  # (4,) of what such angles would show, at most 1

    @property
    def explain(self) -> bool:
        """Whether they explain what was seen."""
        return bool(np.all(self.likeness > _LIKE))


class PhaseResponses:
    """What the phases moved, (12, 2, p, 6) [m]: phase, the current's sign (+, -), place, encoder.

    ``places``: x, z of the platen before each phase, (12, p, 2) [m].
    """

    def __init__(
        self, parameters: BridgeParameters, peak: float, moved: FloatArray, places: FloatArray
    ) -> None:
        self._parameters, self._peak, self._places = parameters, peak, places
        self._shapes = [_shape(motor, moved[_phases(motor)]) for motor in range(MOTORS)]

    def near(self, foretold: FloatArray) -> Angles:
        """Angles within 0.35 rad of those believed in, each with the friction that suits best.

        ``foretold``: what the twins of :func:`friction_variants` would move, (n, 12, 2, p, 6) [m].
        """
        machines, found = friction_variants(self._parameters), []
        for motor in range(MOTORS):
            likeness = self._likeness(motor, foretold[:, _phases(motor)])
            suits = int(np.argmax(likeness))
            beside = self._turned(motor, machines[suits], (-_NEAR, _NEAR))
            found.append(_highest([beside[0], likeness[suits], beside[1]], _NEAR))
        return Angles(*np.array(found).T)

    def anywhere(self) -> Angles:
        """Angles anywhere on the circle."""
        step = 2.0 * math.pi / _TURNS
        around, found = [step * turn for turn in range(_TURNS)], []
        for motor in range(MOTORS):
            likeness = self._turned(motor, self._parameters, around)
            best = int(np.argmax(likeness))
            off, like = _highest(np.roll(likeness, 1 - best)[:3], step)
            found.append((math.remainder(around[best] + off, 2.0 * math.pi), like))
        return Angles(*np.array(found).T)

    def _turned(
        self, motor: int, parameters: BridgeParameters, angles: Iterable[float]
    ) -> FloatArray:
        """How much this motor resembles the same one with its angle off by each [rad]."""
        twins = Twins(angle_variants(parameters, angles), self._peak)
        moved = [
            [twins.phase(phase, place) for place in self._places[phase]] for phase in _phases(motor)
        ]  # phase, place, n, sign, encoder
        return self._likeness(motor, np.transpose(moved, (2, 0, 3, 1, 4)))

    def _likeness(self, motor: int, moved: FloatArray) -> FloatArray:
        """How much it resembles one whose phases move that, (n, 3, 2, p, 6) [m]; (n,)."""
        return np.array([self._shapes[motor] @ _shape(motor, one) for one in moved])


def _phases(motor: int) -> list[int]:
    return [3 * motor, 3 * motor + 1, 3 * motor + 2]


def _shape(motor: int, moved: FloatArray) -> FloatArray:
    """Shares of one motor's way along and of its tilts in what its phases moved, (3, 2, p, 6)."""
    along = moved[..., 5 if motor % 2 == 0 else 4]
    tilted = moved[..., motor % 2] - moved[..., motor % 2 + 2]
    shares = []
    for way in (along, tilted):
        root = np.sign(way) * np.sqrt(np.abs(way))
        shares.append(root.ravel() / max(float(np.linalg.norm(root)), 1e-12))
    return np.concatenate(shares) / math.sqrt(2.0)


def _highest(likeness: Sequence[float] | FloatArray, step: float) -> tuple[float, float]:
    """Where the parabola through three that are a step apart is highest, within it, and the most.

    0 is the middle one.
    """
    before, here, after = likeness
    bend = before - 2.0 * here + after
    rise = 0.5 * (after - before)
    way = -rise / bend if bend < 0.0 else math.copysign(1.0, rise)
    return step * min(max(way, -1.0), 1.0), float(np.max(likeness))
