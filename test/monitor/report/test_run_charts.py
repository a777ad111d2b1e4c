"""The report's figures show what the figures in numbers say."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from made_up_run import TOPICS, open_bag, write_samples

from maglev_monitor.bag.analysis import analyse
from maglev_monitor.report.run_charts import charts


def test_every_step_stands_beside_its_own_figures(tmp_path: Path, run: Any, encoder: Any) -> None:
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
