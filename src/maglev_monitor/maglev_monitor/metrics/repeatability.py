"""Accuracy and repeatability of positioning, bidirectional, as ISO 230-2 defines them. No ROS."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maglev_model.axes import FloatArray


class Repeatability(NamedTuple):
    """Figures of an axis over its targets, in the unit of the deviations."""

    bidirectional: float  # R: largest of 2 s↑ + 2 s↓ + |B|, 4 s↑, 4 s↓ of a target
    reversal: float  # B: largest |mean from below - mean from above|
    bias: float  # largest |mean of both directions|
    three_sigma: float  # 3 s of the worst target and direction, as makers of stages quote it
    accuracy: float  # A: from the lowest mean - 2 s to the highest mean + 2 s


def repeatability(upward: FloatArray, downward: FloatArray) -> Repeatability:
    """From deviations (targets, approaches) approached from below and from above.

    Raises ValueError for other shapes than (m, n) twice, with n of at least 2; the standard wants
    five targets and five approaches.
    """
    if upward.ndim != 2 or upward.shape != downward.shape or upward.shape[1] < 2:
        raise ValueError(
            'upward and downward must have one shape (targets, approaches), with two approaches or '
            f'more, not {upward.shape} and {downward.shape}'
        )
    mean = np.stack([upward.mean(axis=1), downward.mean(axis=1)])
    return of_moments(mean, np.stack([upward.std(axis=1, ddof=1), downward.std(axis=1, ddof=1)]))


def of_moments(mean: FloatArray, deviation: FloatArray) -> Repeatability:
    """From means and standard deviations (2, targets), approached from below, then from above."""
    (up, down), (s_up, s_down) = mean, deviation
    spread = np.maximum(2.0 * (s_up + s_down) + np.abs(up - down), 4.0 * np.maximum(s_up, s_down))
    return Repeatability(
        bidirectional=float(spread.max()),
        reversal=float(np.abs(up - down).max()),
        bias=float(np.abs(0.5 * (up + down)).max()),
        three_sigma=float(3.0 * deviation.max()),
        accuracy=float((mean + 2.0 * deviation).max() - (mean - 2.0 * deviation).min()),
    )
