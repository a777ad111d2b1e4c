"""Two runs side by side: their figures, what they were told, and their errors. No ROS here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from maglev_model.axes import AXES
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.readable import angle_or_length, micro, seconds
from maglev_monitor.metrics.result_file import write_whole
from maglev_monitor.report.chart import (
    ERROR,
    POSITION,
    Chart,
    Panels,
    column,
    legend,
    line,
    magnitude,
)
from maglev_monitor.report.chart import render as render_charts
from maglev_monitor.report.page import bullets, header, html_table, page
from maglev_monitor.report.scales import FLOOR, units

_COLOURS = (POSITION, ERROR)
_FROM_BEST = ('pass', 'incomplete', 'fail')
_FIGURES = (('mean_abs_error', 'mean |e|'), ('rms_error', 'rms e'), ('max_abs_error', 'max |e|'))


def write_two_runs(path: Path, names: Sequence[str], analyses: Sequence[Analysis]) -> None:
    """Write the page in one go. Raises OSError when the folder cannot be written."""
    write_whole(path, render(names, analyses))


def render(names: Sequence[str], analyses: Sequence[Analysis]) -> str:
    """The page as HTML; nothing is fetched.

    :param names: what the two runs are called.
    :param analyses: of each run, in the same order.
    """
    verdict = max((analysis.result['verdict'] for analysis in analyses), key=_FROM_BEST.index)
    parts = [header('Two runs', verdict, names)]
    for letter, name, analysis in zip('AB', names, analyses, strict=True):
        parts.append(bullets(f'{letter}: {name}, {analysis.result["verdict"]}', _facts(analysis)))
    heads = ['', 'A', 'B', 'B ÷ A']
    errors, steps = _error_rows(analyses), _step_rows(analyses)
    if errors:
        parts.append('<h2>Tracking errors</h2>' + html_table(heads, errors))
    if steps:
        parts.append('<h2>Steps</h2>' + html_table(heads[:3], steps))
    parts += render_charts([_errors(analyses)])
    return page('two runs', parts)


def _facts(analysis: Analysis) -> list[str]:
    """What a run was, and what it was told that the other may not have been."""
    result = analysis.result
    facts = [str(result[key]) for key in ('scenario', 'stage', 'mode') if result[key]]
    facts.append(f'errors of the {result["error_source"]} position')
    return [', '.join(facts), *(f'{node}: {change}' for node, change in analysis.changes)]


def _error_rows(analyses: Sequence[Analysis]) -> list[list[str]]:
    rows = []
    for name, short in _FIGURES:
        for axis in AXES:
            found = [analysis.result['axes'][axis][name] for analysis in analyses]
            if any(value is None for value in found):
                continue
            ratio = f'{found[1] / found[0]:.2f}' if found[0] else ''
            rows.append([f'{short} of {axis}', *(micro(axis, value) for value in found), ratio])
    return rows


def _step_rows(analyses: Sequence[Analysis]) -> list[list[str]]:
    """The steps that both runs made."""
    first, second = ({_key(step): step for step in a.result['steps']} for a in analyses)
    rows = []
    for key, step in first.items():
        if key in second:
            axis, start, target = key
            name = f'{axis}, {angle_or_length(axis, start)} to {angle_or_length(axis, target)}'
            rows.append([name, _step(step), _step(second[key])])
    return rows


def _key(step: dict[str, Any]) -> tuple[str, float, float]:
    return step['axis'], round(step['from'], 7), round(step['to'], 7)


def _step(step: dict[str, Any]) -> str:
    settled, encoder = seconds(step['settling_time']), seconds(step['encoder_time'])
    return f'overshoot {step["overshoot_percent"]:.1f} %, t_s {settled}, t_enc {encoder}'


def _errors(analyses: Sequence[Analysis]) -> Chart:
    panels, drawn = Panels('time since lift-off [s]'), []
    for index, axis in enumerate(AXES):
        panel = panels.panel(f'error of {axis}', f'|e| [{units(axis)[1]}]', y_axis_type='log')
        for letter, colour, analysis in zip('AB', _COLOURS, analyses, strict=True):
            whole, source = analysis.curves.whole_run, analysis.result['error_source']
            time = (whole.sequence - whole.sequence[0]) * analysis.run.sample_time
            error = magnitude(whole, column(f'{source}_error', index, 1e6))
            line(panel, time, np.maximum(error, FLOOR), letter, colour)
        legend(panel)
        drawn.append(panel)
    caption = (
        'The largest absolute error of each instant of both runs; a click on a letter hides its'
        ' curve.'
    )
    return Chart('Errors', caption, drawn)
