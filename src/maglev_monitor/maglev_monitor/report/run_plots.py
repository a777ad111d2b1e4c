"""The report's figures: the paper's Figs. 4 to 8, currents and timing. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from maglev_model.axes import AXES
from maglev_model.phases import Phase
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.curves import COLUMNS, StepCurves
from maglev_monitor.report.drawing import (
    ERROR,
    FLOOR,
    MOVES,
    POSITION,
    REFERENCE,
    SECOND,
    STYLE,
    TITLES,
    Plot,
    column,
    envelope,
    extremes,
    to_plot,
    units,
)

FloatArray = NDArray[np.float64]


def plots(analysis: Analysis) -> Iterator[Plot]:
    """All figures that the run gives something for, in the order of the report."""
    makers = (_overview, _steps, _tracking, _path, _currents, _timing)
    with plt.rc_context(STYLE):
        for maker in makers:
            made = maker(analysis)
            if made is not None:
                yield to_plot(*made)


_Made = tuple[str, str, Figure] | None


def _overview(analysis: Analysis) -> _Made:
    whole, source = analysis.curves.whole_run, analysis.result['error_source']
    time = _time(analysis, whole.sequence)
    figure, panels = plt.subplots(5, 2, figsize=(11.0, 10.5), sharex=True, squeeze=False)
    for index, axis in enumerate(AXES):
        left, right = panels[index]
        milli, micro = units(axis)
        _shade(left, analysis, time)
        _shade(right, analysis, time)
        envelope(left, time, whole, column(source, index), 1e3, POSITION, source)
        reference = 1e3 * whole.first[:, column('reference', index)]
        left.plot(time, reference, color=REFERENCE, lw=0.8, ls='--', label='reference')
        left.set(ylabel=f'{axis} [{milli}]', title=TITLES[axis])
        error = 1e6 * np.abs(extremes(whole, column(f'{source}_error', index))).max(axis=0)
        right.fill_between(time, FLOOR, np.maximum(error, FLOOR), color=ERROR, lw=0.0, alpha=0.85)
        top = max(2.0 * float(np.nanmax(error, initial=0.0)), 10.0)
        right.set(ylabel=f'|e| [{micro}]', title=f'error of {axis}')
        right.set(yscale='log', ylim=(FLOOR, top))
    panels[0][0].legend(loc='best', ncols=2)
    for panel in panels[-1]:
        panel.set_xlabel('time since lift-off [s]')
    caption = (
        'Position (solid), reference (dashed) and, on a logarithmic scale, the absolute error over '
        'the whole run. Each point spans the least and greatest value of its instant, so no peak '
        'is lost. The tracking window is shaded.'
    )
    return 'The whole run', caption, figure


def _tracking(analysis: Analysis) -> _Made:
    sequence, values = analysis.curves.tail
    if not len(sequence):
        return None
    source = analysis.result['error_source']
    time = _time(analysis, sequence)
    figure, panels = plt.subplots(5, 2, figsize=(11.0, 10.5), sharex=True, squeeze=False)
    for index, axis in enumerate(AXES):
        left, right = panels[index]
        milli, micro = units(axis)
        left.plot(
            time, 1e3 * values[:, column(source, index)], color=POSITION, lw=1.3, label=source
        )
        reference = 1e3 * values[:, column('reference', index)]
        left.plot(time, reference, color=REFERENCE, lw=0.9, ls='--', label='reference')
        if np.ptp(reference) < MOVES:
            margin = max(2.0 * float(np.nanmax(np.abs(_centred(left, reference)))), 1e-3)
            left.set_ylim(reference[0] - margin, reference[0] + margin)
        left.set(ylabel=f'{axis} [{milli}]', title=TITLES[axis])
        right.plot(time, 1e6 * values[:, column(f'{source}_error', index)], color=ERROR, lw=0.7)
        right.axhline(0.0, color='#444444', lw=0.6)
        mean = analysis.result['axes'][axis]['mean_abs_error']
        note = f' — mean |e| over the window {1e6 * mean:.1f} {micro}' if mean is not None else ''
        right.set(ylabel=f'e [{micro}]', title=f'error of {axis}{note}')
    panels[0][0].legend(loc='best', ncols=2)
    for panel in panels[-1]:
        panel.set_xlabel('time since lift-off [s]')
    span = (int(sequence[-1]) - int(sequence[0]) + 1) * analysis.run.metrics.sample_time
    caption = f'The last {span:.1f} s of tracking, every sample (as Figs. 7, 8 of the paper).'
    return 'Tracking in detail', caption, figure


def _centred(panel: Axes, reference: FloatArray) -> FloatArray:
    drawn = np.asarray(panel.lines[0].get_ydata(), float)
    centred: FloatArray = drawn - reference[0]
    return np.where(np.isnan(centred), 0.0, centred)


def _steps(analysis: Analysis) -> _Made:
    stepped = [
        (index, step)
        for step in analysis.curves.steps
        for index in range(5)
        if abs(step.target[index] - step.start[index]) > MOVES
    ]
    if not stepped:
        return None
    used = sorted({index for index, _ in stepped})
    size = (11.0, 2.7 * len(used) + 0.3)
    figure, panels = plt.subplots(len(used), 2, figsize=size, squeeze=False)
    for (left, right), index in zip(panels, used, strict=True):
        steps = [step for other, step in stepped if other == index]
        _step_panels(analysis, left, right, index, steps)
    caption = (
        'Every step of an axis from its first sample on, and its absolute error on a logarithmic '
        'scale (as Figs. 4 and 5 of the paper). The lines are the bounds of t_s and t_enc.'
    )
    return 'Steps', caption, figure


def _step_panels(
    analysis: Analysis, left: Axes, right: Axes, index: int, steps: list[StepCurves]
) -> None:
    axis, source = AXES[index], analysis.result['error_source']
    milli, micro = units(axis)
    colours = plt.get_cmap('viridis')(np.linspace(0.0, 0.8, len(steps)))
    for step, colour in zip(steps, colours, strict=True):
        time = (step.sequence - step.sequence[0]) * analysis.run.metrics.sample_time
        name = f'{1e3 * step.start[index]:g} → {1e3 * step.target[index]:g} {milli}'
        envelope(left, time, step, column(source, index), 1e3, colour, name)
        reference = 1e3 * step.first[:, column('reference', index)]
        left.plot(time, reference, color=REFERENCE, lw=0.8, ls='--')
        error = 1e6 * np.abs(extremes(step, column(f'{source}_error', index))).max(axis=0)
        right.semilogy(time, np.maximum(error, FLOOR), color=colour, lw=0.9)
    settings = analysis.run.metrics
    for bound, name in ((settings.settling_bound, 't_s'), (settings.encoder_bound, 't_enc')):
        right.axhline(1e6 * bound[index], color='#444444', lw=0.7, ls=':')
        right.text(0.0, 1.1e6 * bound[index], name, color='#444444', fontsize=7.5)
    left.set(ylabel=f'{axis} [{milli}]', title=TITLES[axis], xlabel='time since the step [s]')
    right.set(ylabel=f'|e| [{micro}]', title=f'error of {axis}', xlabel='time since the step [s]')
    left.legend(loc='lower right')


def _path(analysis: Analysis) -> _Made:
    whole, source = analysis.curves.whole_run, analysis.result['error_source']
    tracked = whole.first[:, COLUMNS['phase']][:, 0] == Phase.TRACK
    points = 1e3 * whole.first[tracked][:, COLUMNS[source]][:, :3]
    wanted = 1e3 * whole.first[tracked][:, COLUMNS['reference']][:, :3]
    if not len(points) or np.count_nonzero(np.ptp(wanted, axis=0) > 1e3 * MOVES) < 2:
        return None
    figure = plt.figure(figsize=(7.5, 6.0))
    panel = figure.add_subplot(projection='3d')
    panel.plot(points[:, 1], points[:, 2], points[:, 0], color=POSITION, lw=0.9, label=source)
    panel.plot(
        wanted[:, 1],
        wanted[:, 2],
        wanted[:, 0],
        color=REFERENCE,
        lw=0.8,
        ls='--',
        label='reference',
    )
    panel.set(xlabel='x [mm]', ylabel='z [mm]', zlabel='air gap y [mm]')
    panel.invert_zaxis()
    panel.legend(loc='upper left')
    caption = 'The path in space during tracking (as Fig. 6 of the paper). The gap grows downwards.'
    return 'The path', caption, figure


def _currents(analysis: Analysis) -> _Made:
    whole, settings = analysis.curves.whole_run, analysis.run.metrics
    if np.isnan(whole.high[:, COLUMNS['phase_current']]).all():
        return None
    time = _time(analysis, whole.sequence)
    figure, panels = plt.subplots(4, 2, figsize=(11.0, 8.4), sharex=True, squeeze=False)
    for motor in range(4):
        left, right = panels[motor]
        for name, colour, label in (
            ('direct_current', POSITION, 'i_d'),
            ('quadrature_current', SECOND, 'i_q'),
        ):
            envelope(left, time, whole, COLUMNS[name].start + motor, 1.0, colour, label)
        high = whole.high[:, COLUMNS['phase_current'].start + motor]
        right.fill_between(
            time, 0.0, high, color=POSITION, lw=0.0, alpha=0.8, label='|phase current|'
        )
        right.axhline(settings.peak_current, color=ERROR, lw=0.9, label='peak')
        right.axhline(settings.continuous_current, color=ERROR, lw=0.9, ls=':', label='continuous')
        right.set_ylim(0.0, 1.1 * max(settings.peak_current, float(np.nanmax(high, initial=0.0))))
        thermal = whole.high[:, COLUMNS['thermal_load'].start + motor]
        title = f'motor {motor + 1}'
        if np.nanmax(thermal, initial=0.0) > 0.0:
            title += f' — thermal budget used up to {100.0 * np.nanmax(thermal):.0f} %'
        left.set(ylabel='[A]', title=f'motor {motor + 1}')
        right.set(ylabel='[A]', title=title)
    panels[0][0].legend(loc='best', ncols=2)
    panels[0][1].legend(loc='best', ncols=3)
    for panel in panels[-1]:
        panel.set_xlabel('time since lift-off [s]')
    caption = (
        'Commanded direct and quadrature currents, and the largest of the three phase currents of '
        "each motor against its amplifier's limits."
    )
    return 'Currents', caption, figure


def _timing(analysis: Analysis) -> _Made:
    whole = analysis.curves.whole_run
    ticks = 1e3 * whole.high[:, COLUMNS['tick']][:, 0]
    histogram = analysis.tick_histogram
    if np.isnan(ticks).all() or not histogram.any():
        return None
    time = _time(analysis, whole.sequence)
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.0, 2.9))
    left.plot(time, ticks, color=POSITION, lw=0.6)
    left.set(xlabel='time since lift-off [s]', ylabel='[ms]', title='longest tick of each instant')
    left.set_ylim(bottom=0.0)
    cumulative = np.cumsum(histogram) / histogram.sum()
    first, last = np.searchsorted(cumulative, [0.0005, 0.999])
    stride = max(1, int(last - first) // 120)
    edges = np.arange(first, last + stride + 1, stride)
    counts = np.add.reduceat(histogram, np.minimum(edges, len(histogram) - 1))
    right.bar(edges[:-1] * 1e-3, counts[:-1], width=stride * 1e-3, align='edge', color=SECOND)
    right.set(xlabel='tick [ms]', ylabel='samples', title='distribution (99.9 %)')
    caption = (
        'Wall-clock time from one measurement to the next. In real time it is the sample time; in '
        'lockstep it is as long as the loop takes.'
    )
    return 'Timing', caption, figure


def _time(analysis: Analysis, sequence: NDArray[np.int64]) -> FloatArray:
    start = analysis.curves.whole_run.sequence[0]
    time: FloatArray = (sequence - start) * analysis.run.metrics.sample_time
    return time


def _shade(panel: Axes, analysis: Analysis, time: FloatArray) -> None:
    """Shade the tracking window."""
    phases = analysis.curves.whole_run.first[:, COLUMNS['phase']][:, 0]
    tracked = np.flatnonzero(phases == Phase.TRACK)
    if len(tracked):
        panel.axvspan(time[tracked[0]], time[tracked[-1]], color='#f2f5fa', zorder=0)
