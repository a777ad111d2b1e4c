"""The paper's Figs. 4 to 8 with one curve for each controller. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from maglev_model.axes import AXES, FloatArray
from maglev_model.paper import STEPS, TRACKING, PublishedStep
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.metrics.curves import StepCurves
from maglev_monitor.metrics.readable import micro
from maglev_monitor.report.drawing import (
    ERROR,
    POSITION,
    REFERENCE,
    SECOND,
    STYLE,
    Plot,
    column,
    envelope,
    extremes,
    to_plot,
)
from maglev_monitor.report.scales import FLOOR, TITLES, units

Runs = Mapping[str, Mapping[str, Analysis]]
"""Analyses by scenario, then by the name of the controller for the legend."""

_COLOURS = (ERROR, POSITION, SECOND)
_TRANSIENT = 4.0  # of a step, drawn on the left [s]
_STEP_FIGURES = (
    (
        'Fig. 4: steps of the air gap',
        ('y',),
        'Each row is one step from rest: position, and absolute error on a logarithmic scale with '
        'the bounds of t_s (0.1 mm) and t_enc (10 µm).',
    ),
    (
        'Fig. 5: steps of the tilt θ',
        ('theta',),
        'As Fig. 4; the bounds are 0.1 mrad and 20 µrad. All other axes are controlled as well; '
        'the paper locked its horizontal guides.',
    ),
    (
        'Table III: steps along X and Z',
        ('x', 'z'),
        'As Fig. 4; the paper gives their limits in Table III and omits the figure.',
    ),
)
_TRACKING_FIGURES = (
    ('Fig. 6: the ellipse, 3DOF', 'ellipse', ('y', 'x', 'z')),
    ('Fig. 7: the air gap, 4DOF', 'ellipse_4dof', ('y',)),
    ('Fig. 8: the tilt θ, 4DOF', 'ellipse_4dof', ('theta',)),
)
_DETAIL = (
    'The last seconds of tracking, every sample: position, and absolute error on a logarithmic '
    'scale. Dotted: the mean |e| that the paper measured on its machine.'
)


def paper_plots(runs: Runs) -> Iterator[Plot]:
    """All figures that the runs give something for, in the paper's order."""
    with plt.rc_context(STYLE):
        for title, stepped, caption in _STEP_FIGURES:
            steps = [step for step in STEPS if step.axis in stepped]
            figure = _step_figure(runs.get('steps', {}), steps)
            if figure is not None:
                yield to_plot(title, caption, figure)
        for title, scenario, axes in _TRACKING_FIGURES:
            tails = {
                name: analysis
                for name, analysis in runs.get(scenario, {}).items()
                if len(analysis.curves.tail[0])
            }
            if tails:
                yield to_plot(title, _DETAIL, _tracking_figure(tails, scenario, axes))


def find_step(analysis: Analysis, step: PublishedStep) -> StepCurves | None:
    """The curves of a step of the paper in a run, None when it was not made."""
    index = AXES.index(step.axis)
    for found in analysis.curves.steps:
        if np.allclose(
            [found.start[index], found.target[index]], [step.start, step.target], atol=1e-9
        ):
            return found
    return None


def _step_figure(analyses: Mapping[str, Analysis], steps: Sequence[PublishedStep]) -> Figure | None:
    rows = []
    for step in steps:
        curves = {name: find_step(analysis, step) for name, analysis in analyses.items()}
        if any(found is not None for found in curves.values()):
            rows.append((step, curves))
    if not rows:
        return None
    figure: Figure
    figure, panels = plt.subplots(
        len(rows), 2, figsize=(11.0, 2.5 * len(rows) + 0.3), squeeze=False
    )
    for (left, right), (step, curves) in zip(panels, rows, strict=True):
        for colour, (name, found) in zip(_COLOURS, curves.items(), strict=False):
            if found is not None:
                _step_curves(left, right, analyses[name], (name, colour), step.axis, found)
        _step_bounds(left, right, next(iter(analyses.values())), step)
    panels[0][0].legend(loc='lower right')
    for panel in panels[-1]:
        panel.set_xlabel('time since the step [s]')
    return figure


def _step_curves(
    left: Axes,
    right: Axes,
    analysis: Analysis,
    style: tuple[str, str],
    axis: str,
    curves: StepCurves,
) -> None:
    name, colour = style
    source, index = analysis.result['error_source'], AXES.index(axis)
    time = (curves.sequence - curves.sequence[0]) * analysis.run.sample_time
    reference = 1e3 * curves.first[:, column('reference', index)]
    left.plot(time, reference, color=REFERENCE, lw=0.9, ls='--')
    envelope(left, time, curves, column(source, index), 1e3, colour, name)
    error = 1e6 * np.abs(extremes(curves, column(f'{source}_error', index))).max(axis=0)
    right.semilogy(time, np.maximum(error, FLOOR), color=colour, lw=0.9)


def _step_bounds(left: Axes, right: Axes, analysis: Analysis, step: PublishedStep) -> None:
    milli, small = units(step.axis)
    index, settings = AXES.index(step.axis), analysis.run.metrics
    for bound, name in ((settings.settling_bound, 't_s'), (settings.encoder_bound, 't_enc')):
        right.axhline(1e6 * bound[index], color='#444444', lw=0.7, ls=':')
        right.text(0.0, 1.1e6 * bound[index], name, color='#444444', fontsize=7.5)
    title = f'{TITLES[step.axis]}: {1e3 * step.start:g} → {1e3 * step.target:g} {milli}'
    left.set(ylabel=f'{step.axis} [{milli}]', title=title)
    left.set_xlim(right=min(left.get_xlim()[1], _TRANSIENT))
    right.set(ylabel=f'|e| [{small}]', title=f'error of {step.axis}')


def _tracking_figure(
    analyses: Mapping[str, Analysis], scenario: str, axes: Sequence[str]
) -> Figure:
    """Positions and errors; of several axes, the path in space in place of the positions."""
    figure: Figure = plt.figure(figsize=(11.0, 2.4 * len(axes) + 0.6))
    grid = figure.add_gridspec(len(axes), 2)
    if len(axes) > 1:
        _path_panel(figure.add_subplot(grid[:, 0], projection='3d'), analyses)
    else:
        _position_panel(figure.add_subplot(grid[:, 0]), analyses, axes[0])
    for row, axis in enumerate(axes):
        panel = figure.add_subplot(grid[row, 1])
        _error_panel(panel, analyses, axis, TRACKING[scenario].mean_error[axis])
    panel.set_xlabel('time [s]')
    return figure


def _tail(analysis: Analysis, name: str, axis: str) -> tuple[FloatArray, FloatArray]:
    """Time [s] and one column of the last tracking samples."""
    sequence, values = analysis.curves.tail
    time = (sequence - sequence[0]) * analysis.run.sample_time
    return time, values[:, column(name, AXES.index(axis))]


def _position_panel(panel: Axes, analyses: Mapping[str, Analysis], axis: str) -> None:
    for colour, (name, analysis) in zip(_COLOURS, analyses.items(), strict=False):
        time, position = _tail(analysis, analysis.result['error_source'], axis)
        panel.plot(time, 1e3 * position, color=colour, lw=1.3, label=name)
    time, reference = _tail(analysis, 'reference', axis)
    panel.plot(time, 1e3 * reference, color=REFERENCE, lw=0.9, ls='--', label='reference')
    panel.set(ylabel=f'{axis} [{units(axis)[0]}]', title=TITLES[axis], xlabel='time [s]')
    panel.set_ylim(top=panel.get_ylim()[1] + 0.25 * np.ptp(1e3 * reference))
    panel.legend(loc='upper center', ncols=3)


def _error_panel(
    panel: Axes, analyses: Mapping[str, Analysis], axis: str, published: float
) -> None:
    means = []
    for colour, analysis in zip(_COLOURS, analyses.values(), strict=False):
        time, error = _tail(analysis, f'{analysis.result["error_source"]}_error', axis)
        panel.semilogy(time, np.maximum(1e6 * np.abs(error), FLOOR), color=colour, lw=0.8)
        means.append(micro(axis, analysis.result['axes'][axis]['mean_abs_error']))
    panel.axhline(1e6 * published, color='#444444', lw=0.9, ls=':')
    title = f'error of {axis} — mean over the window {" and ".join(means)}'
    panel.set(ylabel=f'|e| [{units(axis)[1]}]', title=title)


def _path_panel(panel: Axes3D, analyses: Mapping[str, Analysis]) -> None:
    curves = [
        (name, colour, analysis.result['error_source'], analysis)
        for colour, (name, analysis) in zip(_COLOURS, analyses.items(), strict=False)
    ]
    curves.append(('reference', REFERENCE, 'reference', curves[-1][3]))
    for name, colour, source, analysis in curves:
        y, x, z = (1e3 * _tail(analysis, source, axis)[1] for axis in ('y', 'x', 'z'))
        panel.plot(
            x, z, y, color=colour, lw=1.0, ls='--' if colour == REFERENCE else '-', label=name
        )
    panel.set(xlabel='x [mm]', ylabel='z [mm]', zlabel='air gap y [mm]')
    panel.invert_zaxis()
    panel.set_box_aspect(None, zoom=0.85)
    panel.legend(loc='upper left')
