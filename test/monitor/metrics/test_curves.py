"""Bounded series keep every extreme; the report's columns are those of the run."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.contract.phases import Phase
from maglev_model.parameters import build
from maglev_monitor.metrics.curves import COLUMNS, RunCurves
from maglev_monitor.metrics.decoding import decode
from maglev_monitor.metrics.envelope import Envelope
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters


@settings(max_examples=60)
@given(data=st.data())
def test_bins_hold_least_greatest_and_first(data: st.DataObject) -> None:
    bins = 2 * data.draw(st.integers(1, 8))
    total = data.draw(st.integers(1, 300))
    start = data.draw(st.integers(0, 10**9))
    seed = data.draw(st.integers(0, 2**32))
    random = np.random.default_rng(seed)
    values = random.standard_normal((total, 2))
    values[random.random((total, 2)) < 0.1] = np.nan
    kept = np.flatnonzero(random.random(total) < 0.9)
    kept = np.union1d(kept, [0])
    series = Envelope(2, bins)
    edges = sorted(data.draw(st.lists(st.integers(0, len(kept)), max_size=6)))
    for part in np.split(kept, edges):
        series.add(start + part, values[part])
    assert len(series.low) <= bins
    assert series.width == 1 or total > bins * series.width / 2
    for index, first in enumerate(series.sequence):
        inside = kept[(start + kept >= first) & (start + kept < first + series.width)]
        for column in range(2):
            known = values[inside, column]
            known = known[~np.isnan(known)]
            found = [part[index, column] for part in (series.low, series.high, series.first)]
            wanted = [known.min(), known.max(), known[0]] if len(known) else [np.nan] * 3
            np.testing.assert_array_equal(found[:2], wanted[:2])
    assert np.nanmax(series.high, initial=-9.0) == np.nanmax(values[kept], initial=-9.0)


def test_first_values_are_the_first_ones() -> None:
    series = Envelope(1, 4)
    series.add(np.arange(8), np.arange(8.0)[:, None])
    np.testing.assert_array_equal(series.first[:, 0], [0.0, 2.0, 4.0, 6.0])
    np.testing.assert_array_equal(series.sequence, [0, 2, 4, 6])


def test_run_curves(run: Any, messages: dict[str, list[bytes]]) -> None:
    metrics, curves = RunMetrics(RunParameters()), RunCurves(RunParameters())
    joiner = Joiner()
    for key, part in messages.items():
        joiner.add(key, decode(key, part))
    for block in joiner.finish():
        curves.add(metrics.add(block))
    moving = (run.phase != Phase.REST) & (run.phase != Phase.END)
    whole = curves.whole_run
    assert whole.width == 1
    np.testing.assert_array_equal(whole.sequence, np.flatnonzero(moving))
    np.testing.assert_array_equal(whole.first[:, COLUMNS['true']], run.position[moving])
    error = (run.position - run.reference)[moving]
    np.testing.assert_array_equal(whole.first[:, COLUMNS['true_error']], error)
    np.testing.assert_allclose(
        whole.first[:, COLUMNS['measured']], run.position[moving], rtol=0.0, atol=1e-12
    )
    ticks = np.diff(run.stamp)[moving[1:]] * 1e-9
    np.testing.assert_allclose(whole.first[1:, COLUMNS['tick']][:, 0], ticks[1:])
    assert [step.target[0] for step in curves.steps] == [0.027, 0.027]
    assert [step.target[4] for step in curves.steps] == [0.0, 0.01]
    assert [len(step.sequence) for step in curves.steps] == [300, 240]
    short = RunCurves(build(RunParameters, {'sample_time': 0.1}))
    joiner = Joiner()
    for key, part in messages.items():
        joiner.add(key, decode(key, part))
    metrics = RunMetrics(RunParameters())
    for block in joiner.finish():
        short.add(metrics.add(block))
    sequence, values = curves.tail
    np.testing.assert_array_equal(short.tail[0], sequence[-30:])
    np.testing.assert_array_equal(sequence, np.flatnonzero(run.phase == Phase.TRACK))
    np.testing.assert_array_equal(values[:, COLUMNS['reference']], run.reference[sequence])
