"""The report of a run: one self-contained HTML file with figures and tables. No ROS here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from maglev_model.axes import AXES
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.readable import (
    angle_or_length,
    holes,
    micro,
    number,
    saturation,
    seconds,
)
from maglev_monitor.report.chart import render as render_charts
from maglev_monitor.report.page import bullets, header, html_table, page, write_page
from maglev_monitor.report.run_charts import charts


def write_report(path: Path, analysis: Analysis) -> None:
    """Write ``report.html`` in one go. Raises OSError when the folder cannot be written."""
    write_page(path, render(analysis))


def render(analysis: Analysis) -> str:
    """The whole report as HTML; nothing is fetched."""
    result = analysis.result
    name = result['scenario'] or 'run'
    parts = [
        _header(result, name),
        bullets('Why', result['reasons']),
        bullets('The bag', analysis.notes),
        bullets('Missing samples', [holes({key: hole}) for key, hole in result['holes'].items()]),
        _cards(result),
        _tracking_table(result),
        _step_table(result),
        _limits_table(result['limits']),
        _changes_table(analysis.changes),
        *render_charts(list(charts(analysis))),
    ]
    return page(name, parts)


def _header(result: Mapping[str, Any], name: str) -> str:
    words = [f'{result[key]}' for key in ('stage', 'mode') if result[key]] + [
        f'{result["duration"]:g} s measured',
        f'{result["samples"]} samples',
        f'errors of the {result["error_source"]} position',
    ]
    return header(name, result['verdict'], words)


def _cards(result: Mapping[str, Any]) -> str:
    timing, currents = result['timing'], result['currents']
    factor = timing['real_time_factor']
    cards = [
        (f'{number(factor)} ×' if factor else '–', 'real time'),
        (_microseconds(timing['tick_p50']), 'median tick'),
        (_microseconds(timing['tick_p99']), '99 % of ticks within'),
        (number(timing['late_samples']), 'late samples'),
        (number(result['missing_samples']), 'missing samples'),
        (f'{currents["peak_phase"]:.2f} A', 'peak phase current'),
        (number(currents['saturated_samples']), saturation(currents).partition(' ')[2]),
    ]
    inner = ''.join(
        f'<div class="card"><b>{value}</b><span>{name}</span></div>' for value, name in cards
    )
    return f'<div class="cards">{inner}</div>'


def _microseconds(value: float | None) -> str:
    return '–' if value is None else f'{value * 1e6:.0f} µs'


def _tracking_table(result: Mapping[str, Any]) -> str:
    axes = result['axes']
    if axes['y']['mean_abs_error'] is None:
        return ''
    names = ('mean_abs_error', 'rms_error', 'max_abs_error')
    rows = [[axis, *(micro(axis, axes[axis][name]) for name in names)] for axis in AXES]
    return '<h2>Tracking errors</h2>' + html_table(['axis', 'mean |e|', 'rms e', 'max |e|'], rows)


def _step_table(result: Mapping[str, Any]) -> str:
    rows = [
        [
            step['axis'],
            angle_or_length(step['axis'], step['from']),
            angle_or_length(step['axis'], step['to']),
            f'{step["overshoot_percent"]:.1f} %',
            seconds(step['settling_time']),
            seconds(step['encoder_time']),
        ]
        for step in result['steps']
    ]
    if not rows:
        return ''
    return '<h2>Steps</h2>' + html_table(['axis', 'from', 'to', 'overshoot', 't_s', 't_enc'], rows)


def _limits_table(limits: Mapping[str, Any]) -> str:
    rows = []
    for name, value in limits.items():
        if isinstance(value, Mapping):
            shown = ', '.join(
                f'{axis} {angle_or_length(axis, bound)}' for axis, bound in value.items()
            )
        else:
            shown = number(value)
        rows.append([name.replace('_', ' '), shown])
    return '<h2>Limits</h2>' + html_table(['limit', 'value'], rows) if rows else ''


def _changes_table(changes: Sequence[tuple[str, str]]) -> str:
    if not changes:
        return ''
    return '<h2>Parameters that are not as by default</h2>' + html_table(['node', ''], changes)
