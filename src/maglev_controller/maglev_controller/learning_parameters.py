"""The parameters of iterative learning."""

from __future__ import annotations

import dataclasses

from maglev_model.parameters import parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class LearningParameters:
    """What is fed forward where the reference repeats, learned from pass to pass."""

    period: float = parameter(
        0.0,
        'after which the tracked reference repeats, whole samples; 0: nothing is learned',
        unit='s',
        within=(0.0, 60.0),
        read_only=True,
    )
    passes: int = parameter(
        8,
        'passes to learn over; 0: only what was loaded is fed forward',
        within=(0, 1000),
        read_only=True,
    )
    gain: float = parameter(
        0.8,
        'share g of what the first pass shows to be missing that is learned from it; of the '
        'k-th after it g / (1 + k g)',
        within=(0.01, 1.0),
        read_only=True,
    )
    bandwidth: float = parameter(
        250.0,
        'frequency up to which it learns',
        unit='rad/s',
        within=(5.0, 1e4),
        read_only=True,
    )
    largest: tuple[float, ...] = parameter(
        (2.0, 2.0, 2.0, 10.0, 10.0),
        'acceleration that is learned at most, per axis',
        unit='m/s^2, rad/s^2',
        within=(0.0, 100.0),
        length=5,
        read_only=True,
    )
    growth: float = parameter(
        1.3,
        'growth of an rms error at which learning ends and the best that it had comes back',
        within=(1.01, 100.0),
        read_only=True,
    )
    file: str = parameter(
        '',
        'what is learned: loaded at start where it is there, saved after landing; empty: none',
        read_only=True,
    )
