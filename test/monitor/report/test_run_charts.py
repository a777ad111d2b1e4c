"""The report's figures show what the figures in numbers say."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_up_run import TOPICS, open_bag, write_samples

from maglev_model.parameters import build
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.metrics import curves
from maglev_monitor.metrics.curves import COLUMNS
from maglev_monitor.metrics.run_parameters import RunParameters
from maglev_monitor.report.error_charts import reversals, spectrum
from maglev_monitor.report.run_charts import charts


def test_every_step_stands_beside_its_own_figures(
    tmp_path: Path, run: Any, encoder: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also behind one of 50 nm."""
    stepped = dataclasses.replace(run, target=run.target.copy())
    stepped.target[run.segment >= 3, 0] = 0.02 + 5e-8
    samples = {key: [encoder.message(stepped, key, n) for n in range(len(run))] for key in TOPICS}
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, stepped, samples)
    writer.close()
    analysis = analyse(tmp_path)
    assert [step['axis'] for step in analysis.result['steps']] == ['y', 'theta']
    (chart,) = (chart for chart in charts(analysis) if chart.title == 'Steps')
    shown = [panel.legend[0].items[0].label.value for panel in chart.panels]
    for words, step in zip(shown[1::2], analysis.result['steps'], strict=True):
        assert words.startswith(f'overshoot {step["overshoot_percent"]:.1f} %')
    assert chart.caption.startswith('Every step of an axis')

    monkeypatch.setattr(curves, '_MOST_STEPS', 1)
    (chart,) = (chart for chart in charts(analyse(tmp_path)) if chart.title == 'Steps')
    assert chart.caption.startswith('Each of the first 1 of 2 steps of an axis')


@pytest.mark.parametrize('period', [2.5e-4, 1e-3])
def test_the_spectrum_s_integral_is_the_variance_of_what_its_caption_names(period: float) -> None:
    """A sine of 50 Hz and 1 µm counts, a drift of 30 µm does not."""
    values = np.zeros((round(3.0 / period), COLUMNS['saturated'].stop))
    time = period * np.arange(len(values))
    error = 1e-6 * (np.sin(100.0 * np.pi * time) + 30.0 * np.sin(0.2 * np.pi * time))
    values[:, COLUMNS['true_error'].start] = error
    run = build(RunParameters, {'sample_time': period})
    result = {'error_source': 'true'}
    shown = SimpleNamespace(tail=(np.arange(len(values)), values))
    chart: Any = spectrum(SimpleNamespace(run=run, result=result, curves=shown))  # type: ignore[arg-type]
    density = chart.panels[0].renderers[0].data_source.data
    total = (np.square(density['y'].astype(float)) * np.gradient(density['x'])).sum()
    fast = np.isclose(density['x'], 50.0, atol=3.0)
    sine = (np.square(density['y'].astype(float)) * np.gradient(density['x']))[fast].sum()
    assert abs(sine - 0.5) < 0.02
    assert total < 0.1 * (1e6 * error).var()
    assert chart.caption.endswith('the variance of what is faster than 0.98 Hz.')


def test_the_spectrum_of_short_tracking_names_the_least_frequency_that_it_has() -> None:
    """Of 0.6 s, less than a segment of it takes, that is 1 / 0.6 s."""
    values = np.zeros((600, COLUMNS['saturated'].stop))
    values[:, COLUMNS['true_error'].start] = np.sin(np.arange(600))
    result, curves = {'error_source': 'true'}, SimpleNamespace(tail=(np.arange(600), values))
    analysis: Any = SimpleNamespace(run=RunParameters(), result=result, curves=curves)
    chart: Any = spectrum(analysis)
    assert chart.panels[0].renderers[0].data_source.data['x'][0] == pytest.approx(1.0 / 0.6)
    assert chart.caption.endswith('faster than 1.7 Hz.')


@pytest.mark.parametrize('gap', [1, 305])
def test_samples_that_are_missing_shift_no_frequency_and_no_velocity(gap: int) -> None:
    """As in a bag of a recorder that loses some, or of two trajectories with a hover between."""
    sequence = np.concatenate([np.arange(1200), np.arange(1200 + gap, 3000 + gap)])
    values = np.zeros((len(sequence), COLUMNS['saturated'].stop))
    time = 1e-3 * sequence
    values[:, COLUMNS['true_error'].start] = 1e-6 * np.sin(100.0 * np.pi * time)
    values[:, COLUMNS['reference'].start] = 1e-3 * time
    result, curves = {'error_source': 'true'}, SimpleNamespace(tail=(sequence, values))
    analysis: Any = SimpleNamespace(run=RunParameters(), result=result, curves=curves)
    density = spectrum(analysis).panels[0].renderers[0].data_source.data  # type: ignore[union-attr]
    assert density['x'][np.argmax(density['y'])] == pytest.approx(50.0, abs=1.0)
    assert np.max(density['y'][density['x'] > 200.0]) < 1e-6 * np.max(density['y'])
    errors = reversals(analysis).panels[0].renderers[0].data_source.data  # type: ignore[union-attr]
    np.testing.assert_allclose(errors['x'], 1.0, rtol=1e-4)  # [mm/s]


def test_errors_that_are_known_at_every_other_sample_have_no_spectrum() -> None:
    values = np.zeros((3000, COLUMNS['saturated'].stop))
    values[:, COLUMNS['true_error'].start] = np.sin(np.arange(3000))
    values[::2, COLUMNS['true_error'].start] = np.nan
    result, curves = {'error_source': 'true'}, SimpleNamespace(tail=(np.arange(3000), values))
    analysis: Any = SimpleNamespace(run=RunParameters(), result=result, curves=curves)
    assert spectrum(analysis) is None
