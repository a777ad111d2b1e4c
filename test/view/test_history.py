"""The window of the live plots against what all samples say."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from maglev_view.web.history import History
from maglev_view.web.page import plotted

BINS, WIDTH = 8, 5


def expected(sequence: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same window from all samples at once."""
    newest = sequence[-1] // WIDTH
    starts = np.arange(newest - BINS + 1, newest + 1)
    low, high = np.full((2, BINS, values.shape[1]), np.nan)
    for row, number in enumerate(starts):
        inside = values[sequence // WIDTH == number]
        if len(inside):
            low[row], high[row] = inside.min(axis=0), inside.max(axis=0)
    return starts * WIDTH, low, high


@given(
    steps=st.lists(st.integers(1, 12), min_size=1, max_size=120),
    cuts=st.lists(st.integers(0, 120), max_size=8),
    seed=st.integers(0, 1000),
)
def test_every_bin_has_its_least_and_its_greatest(
    steps: list[int], cuts: list[int], seed: int
) -> None:
    sequence = np.cumsum(steps)
    values = np.random.default_rng(seed).normal(size=(len(steps), 2))
    history = History(2, BINS, WIDTH)
    for part in np.split(np.arange(len(steps)), sorted(cuts)):
        history.add(sequence[part], values[part])
    for found, wanted in zip(history.curves(), expected(sequence, values), strict=True):
        np.testing.assert_array_equal(found, wanted)


def test_a_peak_of_one_sample_is_seen() -> None:
    history = History(1, 10, 100)
    values = np.zeros((1000, 1))
    values[437] = 7.0
    history.add(np.arange(1000), values)
    _, low, high = history.curves()
    assert high[:, 0].tolist() == [0.0] * 4 + [7.0] + [0.0] * 5
    assert not low.any()


def test_a_stage_that_begins_anew_begins_the_window_anew() -> None:
    history = History(1, BINS, WIDTH)
    history.add(np.arange(100), np.ones((100, 1)))
    history.add(np.arange(5), np.full((5, 1), 2.0))
    sequence, low, high = history.curves()
    assert sequence[-1] == 0
    assert np.isnan(low[:-1]).all()
    assert (low[-1], high[-1]) == (2.0, 2.0)


def test_a_plot_begins_with_what_is_known() -> None:
    low = np.array([[np.nan, np.nan], [np.nan, 1.0], [2.0, 3.0], [np.nan, np.nan], [4.0, 5.0]])
    time, *curves = plotted(np.arange(5.0), low, low + 1.0)
    np.testing.assert_array_equal(time, [2.0, 3.0, 4.0])
    wanted = [[2.0, np.nan, 4.0], [3.0, np.nan, 5.0], [3.0, np.nan, 5.0], [4.0, np.nan, 6.0]]
    np.testing.assert_array_equal(curves, wanted)
