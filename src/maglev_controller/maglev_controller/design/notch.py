"""Notches in series with the feedback, sampled biquads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from maglev_controller.design.state_space import ComplexArray, StateSpace

MOST: Final = 4
"""Notches of an axis at most."""


class Notch(NamedTuple):
    """y = b₀ u + s₁, s₁⁺ = b₁ u − a₁ y + s₂, s₂⁺ = b₂ u − a₂ y."""

    b_0: float
    b_1: float
    b_2: float
    a_1: float
    a_2: float


def notch(frequency: float, depth: float, width: float, period: float) -> Notch:
    """``(s² + 2 ζ₁ ω s + ω²) / (s² + 2 ζ₂ ω s + ω²)`` by Tustin's rule, exact at ω.

    ``frequency`` ω [rad/s], below π / ``period``; ``depth`` ζ₁; ``width`` ζ₂. Gain 1 far from ω.
    """
    warped = math.tan(0.5 * frequency * period)
    square = warped**2
    scale = 1.0 + 2.0 * width * warped + square
    middle = 2.0 * (square - 1.0) / scale
    return Notch(
        (1.0 + 2.0 * depth * warped + square) / scale,
        middle,
        (1.0 - 2.0 * depth * warped + square) / scale,
        middle,
        (1.0 - 2.0 * width * warped + square) / scale,
    )


def notch_response(each: Notch, z: ComplexArray) -> ComplexArray:
    """Frequency response of one notch at ``z`` (m,)."""
    b_0, b_1, b_2, a_1, a_2 = each
    return np.asarray((b_0 + b_1 / z + b_2 / z**2) / (1.0 + a_1 / z + a_2 / z**2))


def notch_system(notches: Sequence[Notch]) -> StateSpace:
    """All of them in series, states (s₁, s₂) of each."""
    size = 2 * len(notches)
    state, drive, output, direct = np.zeros((size, size)), np.zeros(size), np.zeros(size), 1.0
    for index, (b_0, b_1, b_2, a_1, a_2) in enumerate(notches):
        row = 2 * index
        for offset, b, a in ((0, b_1, a_1), (1, b_2, a_2)):
            state[row + offset] = (b - a * b_0) * output
            state[row + offset, row] -= a
            drive[row + offset] = (b - a * b_0) * direct
        state[row, row + 1] = 1.0
        output, direct = b_0 * output, b_0 * direct
        output[row] = 1.0
    return StateSpace(state, drive, output, direct)
