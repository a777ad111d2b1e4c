"""The report of a run: one self-contained HTML file with figures and tables. No ROS here."""

from __future__ import annotations

import datetime
import html
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from maglev_model.paper import PublishedTracking
from maglev_model.parameters import specs
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.readable import (
    angle_or_length,
    holes,
    micro,
    number,
    saturation,
)
from maglev_monitor.metrics.result_file import write_whole
from maglev_monitor.metrics.run_parameters import RunLimits
from maglev_monitor.report import tables
from maglev_monitor.report.chart import render as render_charts
from maglev_monitor.report.page import REPLAY, bullets, header, html_table, page
from maglev_monitor.report.published import published_step, published_tracking
from maglev_monitor.report.run_charts import charts

_PAPER = "the paper's machine"
_LIMITS = specs(RunLimits)


def write_report(path: Path, analysis: Analysis) -> None:
    """Write ``report.html`` in one go. Raises OSError when the folder cannot be written."""
    replay = REPLAY if (path.parent / REPLAY).is_file() else ''
    write_whole(path, render(analysis, replay))


def render(analysis: Analysis, replay: str = '') -> str:
    """The whole report as HTML; nothing is fetched. ``replay`` is a page beside it to lead to."""
    result = analysis.result
    name = result['scenario'] or 'run'
    parts = [
        _header(result, name),
        _origin(analysis, replay),
        bullets('Why', result['reasons']),
        bullets('The bag', analysis.notes),
        bullets('Missing samples', [holes({key: hole}) for key, hole in result['holes'].items()]),
        _cards(result),
        _errors_tables(result, published_tracking(analysis)),
        _tables('Repeatability, ISO 230-2', tables.REPEATED, tables.repeatability(result)),
        _steps_tables(result),
        _further_table(result.get('further', {})),
        _limits_table(result),
        *render_charts(list(charts(analysis))),
        _changes_table(analysis.changes),
    ]
    return page(name, parts)


def _header(result: Mapping[str, Any], name: str) -> str:
    words = [f'{result[key]}' for key in ('stage', 'mode') if result[key]] + [
        f'{result["duration"]:g} s measured',
        f'{result["samples"]} samples',
        f'errors of the {result["error_source"]} position',
    ]
    return header(name, result['verdict'], words)


def _origin(analysis: Analysis, replay: str) -> str:
    """When and by what it was flown, as far as the bag says, and the way to the replay."""
    custom, begun = analysis.custom, analysis.curves.begun
    words = [f'Flown by {custom["command"]}' if 'command' in custom else 'Flown']
    if begun is not None:
        when = datetime.datetime.fromtimestamp(1e-9 * begun, datetime.timezone.utc)
        words.append(f'on {when:%Y-%m-%d at %H:%M} UTC')
    if 'software' in custom:
        words.append(f'with {custom["software"]}')
    link = f' <a href="{replay}">See it fly again in 3D.</a>' if replay else ''
    return f'<p class="note">{html.escape(" ".join(words))}.{link}</p>'


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


def _errors_tables(result: Mapping[str, Any], published: PublishedTracking | None) -> str:
    heads, found = tuple(tables.ERRORS.values()), tables.errors(result)
    if published is None:
        return _tables('Tracking errors', heads, found)
    paper = published.mean_error
    return _tables(
        'Tracking errors',
        (*heads, f'{_PAPER}: mean |e|'),
        (
            (whose, [[*row, micro(row[0], paper.get(row[0]))] for row in rows])
            for whose, rows in found
        ),
    )


def _steps_tables(result: Mapping[str, Any]) -> str:
    published = [published_step(step) for step in result['steps']]
    if not any(published):
        return _tables('Steps', tables.STEPS, tables.steps(result))
    told = [', '.join(known[3:]) if known else '' for known in published]
    return _tables(
        'Steps',
        (*tables.STEPS, _PAPER),
        (
            (whose, [[*row, words] for row, words in zip(rows, told, strict=True)])
            for whose, rows in tables.steps(result)
        ),
    )


def _tables(title: str, heads: Iterable[str], found: Iterable[tuple[str, list[list[str]]]]) -> str:
    parts = [html_table([whose, *heads], rows) for whose, rows in found]
    return f'<h2>{title}</h2>' + ''.join(parts) if parts else ''


def _further_table(further: Mapping[str, Mapping[str, float | None]]) -> str:
    rows = [
        [module, name, '–' if value is None else number(value)]
        for module, figures in further.items()
        for name, value in figures.items()
    ]
    return '<h2>Further metrics</h2>' + html_table(['module', 'figure', ''], rows) if rows else ''


def _limits_table(result: Mapping[str, Any]) -> str:
    rows = []
    for name, value in result['limits'].items():
        if isinstance(value, Mapping):
            shown = ', '.join(
                f'{axis} {angle_or_length(axis, bound)}' for axis, bound in value.items()
            )
        else:
            shown = f'{number(value)} {_LIMITS[name].unit}'.rstrip()
        rows.append([name.replace('_', ' '), shown])
    judged = tables.NAMES['own' if result['own_axes'] else result['error_source']]
    more = ', errors with half a count more' if judged == tables.NAMES['measured'] else ''
    caption = f'<p class="caption">Errors and steps that are checked: {judged}{more}.</p>'
    return f'<h2>Limits</h2>{caption}{html_table(["limit", "value"], rows)}' if rows else ''


def _changes_table(changes: Sequence[tuple[str, str]]) -> str:
    if not changes:
        return ''
    table = html_table(['node', ''], changes, 'words')
    return f'<h2>Parameters that are not as by default</h2>{table}'
