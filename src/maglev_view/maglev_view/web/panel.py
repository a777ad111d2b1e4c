"""What the page says in words and bars, as HTML. No ROS here."""

from __future__ import annotations

import math
from collections.abc import Iterable
from html import escape

import numpy as np

from maglev_model.axes import AXES
from maglev_view.colours import AXIS_COLOURS, colour_of, within
from maglev_view.web.live import Live

_SCALE, _UNITS = 1e6, ('µm', 'µm', 'µm', 'µrad', 'µrad')
_PATIENCE = 1.0  # with a stage that is silent [s]
_CELL = 'padding:1px 6px 1px 0'


def status_html(live: Live) -> str:
    """Phase, mode, time, pace, late samples, the errors now, and the faults with their remedies."""
    if live.sequence < 0:
        return '<div style="font-size:90%">no stage is heard yet</div>'
    late = 'no sample late' if not live.late_samples else f'{live.late_samples} samples late'
    pace = '' if math.isnan(live.pace) else f' at {live.pace:.2f} × real time'
    rows = [
        ('phase', f'{live.phase or "–"}, controller {live.mode.lower() or "–"}'),
        ('stage time', f'{live.stage_time:.2f} s{pace}'),
        ('late', late),
    ]
    if live.silence > _PATIENCE:
        rows.append(('silent', f'no sample for {live.silence:.0f} s'))
    return _table(rows) + _errors(live) + _faults(live)


def _errors(live: Live) -> str:
    """Of the window: the greatest error of each axis."""
    _, low, high = live.errors.curves()
    peaks = np.fmax(np.abs(low), np.abs(high))
    known = ~np.isnan(peaks)
    if not known.any():
        return ''
    greatest = np.max(np.where(known, peaks, 0.0), axis=0)
    texts = (
        f'<b style="color:{colour}">{axis}</b> {_SCALE * value:.1f} {unit}'
        for axis, colour, value, unit in zip(AXES, AXIS_COLOURS, greatest, _UNITS, strict=True)
    )
    return f'<div style="font-size:90%">greatest |e| below: {", ".join(texts)}</div>'


def _faults(live: Live) -> str:
    found = []
    for name, state in sorted(live.faults().items()):
        remedy = f'<br>what to do: {escape(state.remedy)}' if state.remedy else ''
        found.append(
            '<div style="border-left:4px solid #b2182b;padding:4px 8px;margin:6px 0">'
            f'<b>{escape(name)}</b>: {escape(state.text)}{remedy}</div>'
        )
    return ''.join(found)


def motors_html(live: Live, peak: float) -> str:
    """A bar for the current of each motor, over ``peak`` [A], and one for its thermal load."""
    rows = []
    for motor in range(4):
        cells = f'<td style="{_CELL}">motor {motor + 1}</td>'
        if live.currents is None:
            cells += _bar(0.0, f'– of {peak:g} A')
        else:
            current = float(live.currents[motor])
            cells += _bar(current / peak, f'{current:.2f} of {peak:g} A')
        if live.load is not None:
            load = float(live.load[motor])
            cells += _bar(load, f'heat {100.0 * load:.0f} %')
        rows.append(f'<tr>{cells}</tr>')
    return f'<table style="width:100%;font-size:85%">{"".join(rows)}</table>'


def _bar(share: float, text: str) -> str:
    share = within(share)
    red, green, blue = (round(255 * part) for part in colour_of(share))
    return (
        f'<td style="{_CELL};width:40%"><div style="background:#8884;height:6px">'
        f'<div style="width:{100.0 * share:.1f}%;height:6px;background:rgb({red},{green},{blue})">'
        f'</div></div>{escape(text)}</td>'
    )


def _table(rows: Iterable[tuple[str, str]]) -> str:
    lines = (
        f'<tr><td style="{_CELL};opacity:.7">{escape(name)}</td><td>{escape(text)}</td></tr>'
        for name, text in rows
    )
    return f'<table style="font-size:90%">{"".join(lines)}</table>'
