"""The report's figures: the paper's Figs. 4 to 8, currents and timing. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.phases import Phase
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.curves import COLUMNS, StepCurves
from maglev_monitor.report.chart import (
    COLOURS,
    ERROR,
    POSITION,
    REFERENCE,
    SECOND,
    Chart,
    Panels,
    band,
    bars,
    column,
    envelope,
    legend,
    level,
    line,
    magnitude,
    mark,
    no_legend,
    shade,
)
from maglev_monitor.report.error_charts import reversals, spectrum
from maglev_monitor.report.published import first_number, published_step, published_tracking
from maglev_monitor.report.scales import FLOOR, MOVES, TITLES, units

_SINCE = 'time since lift-off [s]'


def charts(analysis: Analysis) -> Iterator[Chart]:
    """All figures that the run gives something for, in the order of the report."""
    makers = (_overview, _steps, _tracking, _beside, reversals, spectrum, _path, _currents, _timing)
    for maker in makers:
        made = maker(analysis)
        if made is not None:
            yield made


def _overview(analysis: Analysis) -> Chart:
    whole, source = analysis.curves.whole_run, analysis.result['error_source']
    time, panels, drawn = _time(analysis, whole.sequence), Panels(_SINCE), []
    for index, axis in enumerate(AXES):
        milli, micro = units(axis)
        left = panels.panel(TITLES[axis], f'{axis} [{milli}]')
        right = panels.panel(f'error of {axis}', f'|e| [{micro}]', y_axis_type='log')
        shade(left, whole, time)
        shade(right, whole, time)
        envelope(left, time, whole, column(source, index, 1e3), source, POSITION)
        reference = 1e3 * whole.first[:, column('reference', index).place]
        line(left, time, reference, 'reference', REFERENCE, line_dash='dashed')
        error = magnitude(whole, column(f'{source}_error', index, 1e6))
        line(right, time, np.maximum(error, FLOOR), '|e|', ERROR)
        drawn += [left, right]
    _name_once(drawn)
    caption = (
        'Position (solid), reference (dashed) and, on a logarithmic scale, the absolute error over '
        'the whole run. Each point spans the least and greatest value of its instant, so no peak '
        'is lost. The tracking window is shaded. Drag to zoom, all panels at once; reset is in the '
        'tools above a panel; a click on a name hides its curve.'
    )
    return Chart('The whole run', caption, drawn)


def _tracking(analysis: Analysis) -> Chart | None:
    sequence, values = analysis.curves.tail
    if not len(sequence):
        return None
    source = analysis.result['error_source']
    time, panels, drawn = _time(analysis, sequence), Panels(_SINCE), []
    for index, axis in enumerate(AXES):
        milli, micro = units(axis)
        left = panels.panel(TITLES[axis], f'{axis} [{milli}]')
        mean = analysis.result['axes'][axis]['mean_abs_error']
        note = f', mean |e| {1e6 * mean:.1f} {micro}' if mean is not None else ''
        right = panels.panel(f'error of {axis}{note}', f'e [{micro}]')
        line(left, time, 1e3 * values[:, column(source, index).place], source, POSITION)
        reference = 1e3 * values[:, column('reference', index).place]
        line(left, time, reference, 'reference', REFERENCE, line_dash='dashed')
        error = 1e6 * values[:, column(f'{source}_error', index).place]
        line(right, time, error, 'e', ERROR)
        level(right, 0.0, dash='solid')
        drawn += [left, right]
    _name_once(drawn)
    span = (int(sequence[-1]) - int(sequence[0]) + 1) * analysis.run.sample_time
    caption = (
        f'The last {span:.1f} s of tracking, every sample (as Figs. 7, 8 of the paper). Mean |e| '
        'is that over the whole window.'
    )
    return Chart('Tracking in detail', caption, drawn)


def _beside(analysis: Analysis) -> Chart | None:
    """The paper's mean errors beside the run's, where it follows the paper's ellipse."""
    published = published_tracking(analysis)
    axes = analysis.result['axes']
    if published is None or axes['y']['mean_abs_error'] is None:
        return None
    panels = []
    for unit, tilts in (('µm', False), ('µrad', True)):
        given = {
            axis: error
            for axis, error in published.mean_error.items()
            if (axis in ('phi', 'theta')) == tilts
        }
        if given:
            ours = [1e6 * axes[axis]['mean_abs_error'] for axis in given]
            paper = [1e6 * error for error in given.values()]
            groups = {"the paper's machine": paper, 'this run': ours}
            panels.append(bars(published.title, f'mean |e| [{unit}]', list(given), groups))
    caption = (
        'Mean |e| over the tracking window, of the paper over 60 s on its own machine (section '
        f'IV-B), of this run by its {analysis.result["error_source"]} position.'
    )
    return Chart("Beside the paper's machine", caption, panels)


def _steps(analysis: Analysis) -> Chart | None:
    figures = iter(analysis.result['steps'])
    stepped = [
        (index, step, next(figures, None))
        for step in analysis.curves.steps
        for index in np.flatnonzero(step.target - step.start).tolist()
    ]
    if not stepped:
        return None
    drawn = []
    for axis in sorted({index for index, _, _ in stepped}):
        steps = [(step, found) for index, step, found in stepped if index == axis]
        drawn += _step_panels(analysis, axis, steps)
    every, shown = len(analysis.result['steps']), len(stepped)
    which = 'Every step' if every <= shown else f'Each of the first {shown} of {every} steps'
    caption = (
        f'{which} of an axis from its first sample on, and its absolute error on a logarithmic '
        'scale (as Figs. 4 and 5 of the paper). The bands are the bounds of t_s and t_enc, the '
        'upright lines the instants at which the error has come to stay within them; in grey those '
        "of the paper's machine, where it made the same step."
    )
    return Chart('Steps', caption, drawn)


def _step_panels(
    analysis: Analysis, index: int, steps: list[tuple[StepCurves, dict[str, Any] | None]]
) -> list[Any]:
    axis, source = AXES[index], analysis.result['error_source']
    period, settings = analysis.run.sample_time, analysis.run.metrics
    milli, micro = units(axis)
    panels = Panels('time since the step [s]')
    left = panels.panel(TITLES[axis], f'{axis} [{milli}]')
    right = panels.panel(f'error of {axis}', f'|e| [{micro}]', y_axis_type='log')
    for number, (step, found) in enumerate(steps):
        colour = COLOURS[number % len(COLOURS)]
        time = (step.sequence - step.sequence[0]) * period
        envelope(left, time, step, column(source, index, 1e3), _step_name(step, index), colour)
        wanted = 1e3 * step.first[:, column('reference', index).place]
        line(left, time, wanted, 'reference', REFERENCE, line_dash='dashed')
        error = magnitude(step, column(f'{source}_error', index, 1e6))
        line(right, time, np.maximum(error, FLOOR), _step_figures(found), colour)
        for name in ('settling_time', 'encoder_time'):
            if found is not None and found[name] is not None:
                mark(right, found[name], colour)
        published = found and published_step(found)
        if published:
            for words in (published.settling_time, published.encoder_time):
                mark(right, first_number(words), REFERENCE)
    for bound in (settings.settling_bound, settings.encoder_bound):
        level(right, 1e6 * bound[index])
        band(right, FLOOR, 1e6 * bound[index])
    legend(left, 'bottom_right')
    legend(right)
    left.legend.orientation = right.legend.orientation = 'vertical'
    return [left, right]


def _step_name(step: StepCurves, index: int) -> str:
    start, target = 1e3 * step.start[index], 1e3 * step.target[index]
    return f'{start:g} → {target:g} {units(AXES[index])[0]}'


def _step_figures(found: dict[str, Any] | None) -> str:
    if found is None:
        return '|e|'
    words = [f'overshoot {found["overshoot_percent"]:.1f} %']
    for name, short in (('settling_time', 't_s'), ('encoder_time', 't_enc')):
        value = found[name]
        words.append(f'{short} ' + ('never' if value is None else f'{value:.3g} s'))
    return ', '.join(words)


def _path(analysis: Analysis) -> Chart | None:
    whole, source = analysis.curves.whole_run, analysis.result['error_source']
    tracked = whole.first[:, COLUMNS['phase']][:, 0] == Phase.TRACK
    points = 1e3 * whole.first[tracked][:, COLUMNS[source]][:, :3]
    wanted = 1e3 * whole.first[tracked][:, COLUMNS['reference']][:, :3]
    if not len(points) or np.count_nonzero(np.ptp(wanted, axis=0) > 1e3 * MOVES) < 2:
        return None
    drawn = []
    for across, up in ((1, 2), (1, 0), (2, 0)):
        name = f'{AXES[across]} [mm]'
        panel = Panels(name).panel(f'{AXES[up]} over {AXES[across]}', f'{AXES[up]} [mm]')
        line(panel, points[:, across], points[:, up], source, POSITION)
        line(panel, wanted[:, across], wanted[:, up], 'reference', REFERENCE, line_dash='dashed')
        panel.y_range.flipped = up == 0
        drawn.append(panel)
    _name_once(drawn)
    caption = (
        'The path during tracking, seen along each axis (Fig. 6 of the paper shows it in space). '
        'The gap grows downwards.'
    )
    return Chart('The path', caption, drawn, columns=3)


def _currents(analysis: Analysis) -> Chart | None:
    whole, settings = analysis.curves.whole_run, analysis.run.metrics
    if np.isnan(whole.high[:, COLUMNS['phase_current']]).all():
        return None
    time, panels, drawn = _time(analysis, whole.sequence), Panels(_SINCE), []
    for motor in range(4):
        left = panels.panel(f'motor {motor + 1}', '[A]')
        envelope(left, time, whole, column('direct_current', motor), 'i_d', POSITION)
        envelope(left, time, whole, column('quadrature_current', motor), 'i_q', SECOND)
        thermal = whole.high[:, column('thermal_load', motor).place]
        title = f'largest phase of motor {motor + 1}'
        if np.nanmax(thermal, initial=0.0) > 0.0:
            title += f', {100.0 * np.nanmax(thermal):.0f} % of its heat'
        right = panels.panel(title, '[A]')
        high = whole.high[:, column('phase_current', motor).place]
        line(right, time, high, 'largest phase current', POSITION)
        level(right, settings.peak_current, ERROR, 'solid')
        level(right, settings.continuous_current, ERROR)
        right.y_range.start = 0.0
        right.y_range.end = 1.05 * max(settings.peak_current, np.nanmax(high))
        drawn += [left, right]
    _name_once(drawn)
    caption = (
        'Commanded direct and quadrature currents, and the largest of the three phase currents of '
        "each motor against its amplifier's peak (solid line) and rating (dotted line); heat is "
        'the share of its thermal budget that was used at most.'
    )
    return Chart('Currents', caption, drawn)


def _timing(analysis: Analysis) -> Chart | None:
    whole = analysis.curves.whole_run
    ticks = 1e3 * whole.high[:, COLUMNS['tick']][:, 0]
    histogram = analysis.tick_histogram
    if np.isnan(ticks).all() or not histogram.any():
        return None
    left = Panels(_SINCE).panel('longest tick of each instant', '[ms]')
    line(left, _time(analysis, whole.sequence), ticks, 'tick', POSITION)
    left.y_range.start = 0.0
    right = Panels('tick [ms]').panel('distribution (99.9 %)', 'samples')
    cumulative = np.cumsum(histogram) / histogram.sum()
    first, last = np.searchsorted(cumulative, [0.0005, 0.999])
    stride = max(1, int(last - first) // 120)
    edges = np.arange(first, last + stride + 1, stride)
    counts = np.add.reduceat(histogram, np.minimum(edges, len(histogram) - 1))
    right.quad(left=edges[:-1] * 1e-3, right=edges[1:] * 1e-3, top=counts[:-1], bottom=0)
    no_legend(left)
    caption = (
        'Wall-clock time from one measurement to the next. In real time it is the sample time; in '
        'lockstep it is as long as the loop takes.'
    )
    return Chart('Timing', caption, [left, right])


def _name_once(panels: list[Any]) -> None:
    """Show the names of curves that are the same in all panels only in the first."""
    for panel in panels:
        no_legend(panel)
    legend(panels[0])
    panels[0].legend.visible = True


def _time(analysis: Analysis, sequence: NDArray[np.int64]) -> FloatArray:
    start = analysis.curves.whole_run.sequence[0]
    time: FloatArray = (sequence - start) * analysis.run.sample_time
    return time
