"""Whose sample time is taken for another than ours."""

from __future__ import annotations

from collections.abc import Iterable
from types import SimpleNamespace

import numpy as np
import pytest

from maglev_node.mode_check import StageCheck

BEGUN = 1_700_000_000_000_000_000  # [ns]


def said(samples: Iterable[tuple[int, int]], ours: float = 1e-3) -> list[str]:
    check = StageCheck('realtime', ours)
    measurements = (SimpleNamespace(sequence=n, stamp=t, lockstep=False) for n, t in samples)
    return [text for each in measurements if (text := check.conflict(each))]


@pytest.mark.parametrize('every', [1, 16])
def test_another_sample_time_is_told_also_where_not_each_sample_is_seen(every: int) -> None:
    samples = [(n, BEGUN + 2_000_000 * n) for n in range(0, 10 * every, every)]
    assert "samples every 2 ms, this node's 'sample_time' is 1 ms" in said(samples)[0]


@pytest.mark.parametrize(('stage', 'ours'), [(1e-3, 1.25e-3), (1.25e-3, 1e-3), (5e-4, 6e-4)])
def test_sample_times_that_are_near_each_other_are_told_apart(stage: float, ours: float) -> None:
    samples = [(n, BEGUN + round(1e9 * stage) * n) for n in range(10)]
    text = f"samples every {1e3 * stage:g} ms, this node's 'sample_time' is {1e3 * ours:g} ms"
    assert text in said(samples, ours)[0]


def test_our_own_is_none_though_time_begins_anew_or_a_sample_comes_twice() -> None:
    first = [(n, BEGUN + 1_000_000 * n) for n in range(10)]
    later = [(n, BEGUN + 5_000_000_000 + 1_000_000 * n) for n in range(10, 20)]
    assert said([*first, first[-1], *later, *first]) == []


def test_stamps_of_a_clock_and_none_at_all_are_believed() -> None:
    assert said((n, BEGUN + 2_000_000 * n + 7_919 * (n % 3) ** 2) for n in range(50)) == []
    assert said((n, 0) for n in range(50)) == []
    jitter = np.random.default_rng(1).integers(-40_000, 40_001, 5000)  # two alike now and then
    for period in (250_000, 1_000_000):
        read = ((n, BEGUN + period * n + int(late)) for n, late in enumerate(jitter))
        assert said(read, 1e-9 * period) == []
