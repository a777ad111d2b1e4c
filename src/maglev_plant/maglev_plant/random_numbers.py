"""Numbers that belong to a seed: while a run lasts by sample, and once when a stage is made."""

from __future__ import annotations

import math

import numpy as np

from maglev_model.compiled import borrowing

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)


@borrowing
def _uniform(key: int) -> float:
    """A number in (0, 1) from an integer, by the finalizer of SplitMix64."""
    bits = np.uint64(key) * _GOLDEN
    bits = (bits ^ (bits >> np.uint64(30))) * _MIX_1
    bits = (bits ^ (bits >> np.uint64(27))) * _MIX_2
    bits ^= bits >> np.uint64(31)
    return (float(bits >> np.uint64(11)) + 0.5) / 9007199254740992.0


@borrowing
def gaussian(seed: int, sample: int, channel: int) -> float:
    """A standard normal number that belongs to one seed, sample and channel (0..7)."""
    key = (seed << 32) ^ (sample * 16 + channel * 2)
    radius = math.sqrt(-2.0 * math.log(_uniform(key)))
    return radius * math.cos(2.0 * math.pi * _uniform(key + 1))


@borrowing
def gaussian_of(stream: int, seed: int, sample: int, channel: int) -> float:
    """As :func:`gaussian`, of further streams (1..) and any channel."""
    return gaussian(seed ^ (stream * 0x2545F491 + channel // 8 * 0x1F83D9AB), sample, channel % 8)


def drawn(seed: int, effect: str) -> np.random.Generator:
    """What an effect is drawn with; others do not change it."""
    return np.random.default_rng([seed, *effect.encode()])
