"""The report of a run: one self-contained HTML file with figures and tables. No ROS here."""

from __future__ import annotations

import base64
import html
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from maglev_monitor.analysis import Analysis
from maglev_monitor.plots import plots
from maglev_monitor.samples import AXES
from maglev_monitor.units import angle_or_length, micro, number, seconds

_CSS = """
:root { --ink: #1d2733; --soft: #66727f; --line: #dfe4ea; --blue: #1f5fa8; }
* { box-sizing: border-box; }
body { font: 15px/1.55 system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif; color: var(--ink);
  margin: 0 auto; max-width: 1120px; padding: 2.2rem 1.4rem 4rem; background: #fff; }
header { border-bottom: 3px solid var(--blue); padding-bottom: 1rem; margin-bottom: 1.4rem; }
h1 { font-size: 1.7rem; margin: 0 0 .2rem; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .4rem; }
.sub, .caption, .note { color: var(--soft); }
.caption { margin: .1rem 0 .6rem; max-width: 62rem; }
.badge { display: inline-block; padding: .1rem .7rem; border-radius: 1rem; color: #fff;
  font-size: .95rem; vertical-align: .25rem; margin-left: .6rem; }
.pass { background: #2a8a62; } .fail { background: #b3321d; } .incomplete { background: #b07a10; }
.cards { display: flex; flex-wrap: wrap; gap: .8rem; margin: 1rem 0; }
.card { border: 1px solid var(--line); border-radius: .5rem; padding: .5rem .9rem; min-width:
8.5rem; } .card b { display: block; font-size: 1.15rem; } .card span { color: var(--soft);
font-size: .85rem; } table { border-collapse: collapse; margin: .3rem 0 1rem; font-variant-numeric:
tabular-nums; } th, td { padding: .28rem .9rem; border-bottom: 1px solid var(--line); text-align:
right; } th { color: var(--soft); font-weight: 600; } th:first-child, td:first-child { text-align:
left; } ul { margin: .3rem 0; padding-left: 1.2rem; } img { max-width: 100%; height: auto; display:
block; } @media print { body { max-width: none; padding: 0; } h2, img { break-inside: avoid; } }
"""


def write_report(path: Path, analysis: Analysis) -> None:
    """Write ``report.html`` in one go. Raises OSError when the folder cannot be written."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + '.tmp')
    temporary.write_text(render(analysis), encoding='utf-8')
    os.replace(temporary, path)


def render(analysis: Analysis) -> str:
    """The whole report as HTML; figures are embedded, nothing is fetched."""
    result = analysis.result
    name = result['scenario'] or 'run'
    parts = [
        '<!DOCTYPE html><html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<title>{html.escape(name)} — maglev stage</title><style>{_CSS}</style></head><body>',
        _header(result, name),
        _list('Why', result['reasons']),
        _list('The bag', analysis.notes),
        _cards(result),
        _tracking_table(result),
        _step_table(result),
        _limits_table(result['limits']),
    ]
    for plot in plots(analysis):
        image = base64.b64encode(plot.png).decode('ascii')
        parts.append(f'<h2>{html.escape(plot.title)}</h2>')
        parts.append(f'<p class="caption">{html.escape(plot.caption)}</p>')
        parts.append(f'<img alt="{html.escape(plot.title)}" src="data:image/png;base64,{image}">')
    parts.append('</body></html>\n')
    return '\n'.join(part for part in parts if part)


def _header(result: Mapping[str, Any], name: str) -> str:
    verdict = result['verdict']
    words = [f'{result[key]}' for key in ('stage', 'mode') if result[key]] + [
        f'{result["duration"]:g} s measured',
        f'{result["samples"]} samples',
        f'errors of the {result["error_source"]} position',
    ]
    return (
        f'<header><h1>{html.escape(name)}<span class="badge {verdict}">{verdict}</span></h1>'
        f'<div class="sub">{html.escape(" · ".join(words))}</div></header>'
    )


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
        (number(currents['saturated_samples']), 'saturated samples'),
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
    return '<h2>Tracking errors</h2>' + _table(['axis', 'mean |e|', 'rms e', 'max |e|'], rows)


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
    return '<h2>Steps</h2>' + _table(['axis', 'from', 'to', 'overshoot', 't_s', 't_enc'], rows)


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
    return '<h2>Limits</h2>' + _table(['limit', 'value'], rows) if rows else ''


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    head = ''.join(f'<th>{html.escape(name)}</th>' for name in heads)
    body = ''.join(
        '<tr>' + ''.join(f'<td>{html.escape(cell)}</td>' for cell in row) + '</tr>' for row in rows
    )
    return f'<table><tr>{head}</tr>{body}</table>'


def _list(title: str, lines: Sequence[str]) -> str:
    if not lines:
        return ''
    items = ''.join(f'<li>{html.escape(line)}</li>' for line in lines)
    return f'<p class="note">{title}:</p><ul>{items}</ul>'
