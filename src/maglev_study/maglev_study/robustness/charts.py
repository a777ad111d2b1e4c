"""The figures of a campaign's page: fans over time, distributions, what matters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, FactorRange
from bokeh.plotting import figure

from maglev_model.axes import AXES, FloatArray
from maglev_monitor.report.chart import (
    COLOURS,
    Chart,
    Panels,
    hover,
    legend,
    line,
    mark,
)
from maglev_monitor.report.scales import FLOOR, units
from maglev_study.robustness.fly import BINS, LOST
from maglev_study.robustness.outcome import SHARES, Group

FIGURES = {'mean': 'mean', 'peak': 'greatest', 'rms': 'rms'}
"""Those of the errors, and what they are called."""

_SHOWN = 8  # parameters of a tornado
_BY_CHANCE = 1.96  # standard deviations of a rank correlation where there is none
_LEAST = 1e-9  # an axis with smaller errors has none [m, rad]
_NOMINAL, _PAPER = '#7d8790', '#d55e00'


class _Span(NamedTuple):
    """One bar: its name, a law, quantiles and extremes over the machines, what to mark beside."""

    name: str
    law: str
    values: FloatArray  # (machines,)
    nominal: float
    published: float | None


def _colours(found: Sequence[Group]) -> dict[str, str]:
    laws = list(dict.fromkeys(one.law for one in found))
    return {law: COLOURS[place % len(COLOURS)] for place, law in enumerate(laws)}


def _by_experiment(found: Sequence[Group]) -> dict[str, list[Group]]:
    """The groups that have something to draw, by the experiment's name."""
    drawn: dict[str, list[Group]] = {}
    for one in found:
        if one.survived and one.nominal.verdict != LOST:
            drawn.setdefault(one.experiment.name, []).append(one)
    return drawn


def fans(found: Sequence[Group]) -> list[Chart]:
    """The errors over time: median, and 5 to 95 % shaded, with the nominal machine's."""
    caption = (
        f'Largest |e| in each of {BINS} parts of the measured time: the median of the machines, '
        'shaded from 5 to 95 % of them; dashed, the nominal machine.'
    )
    colours, charts = _colours(found), []
    for name, mine in _by_experiment(found).items():
        time: FloatArray = mine[0].experiment.measured / BINS * (0.5 + np.arange(BINS, dtype=float))
        panels, drawn = Panels('measured time [s]'), []
        for axis, label in enumerate(AXES):
            shown = [one for one in mine if one.figures('peak')[:, axis].max() > _LEAST]
            if not shown:
                continue
            panel = panels.panel(label, f'|e| [{units(label)[1]}]', y_axis_type='log')
            for one in shown:
                _fan(panel, time, one, axis, colours[one.law])
            legend(panel)
            drawn.append(panel)
        charts.append(Chart(f'Errors over time: {name}', caption, drawn, columns=3))
    return charts


def _fan(panel: figure, time: FloatArray, group: Group, axis: int, colour: str) -> None:
    low, middle, high = np.maximum(1e6 * group.fan()[:, :, axis], FLOOR)
    usual = np.maximum(1e6 * group.nominal.envelope[:, axis], FLOOR)
    source = ColumnDataSource({'x': time, 'low': low, 'high': high})
    panel.varea('x', 'low', 'high', source=source, color=colour, alpha=0.25, legend_label=group.law)
    line(panel, time, middle, group.law, colour)
    line(panel, time, usual, group.law, colour, line_dash='dashed')


def distributions(found: Sequence[Group]) -> list[Chart]:
    """Every figure over the machines: 5 to 95 %, median, extremes, nominal, the paper's."""
    caption = (
        'Bars from 5 to 95 % of the machines, within them the median, lines to the extremes. '
        'Diamonds: the nominal machine. Crosses: what the paper measured on its own.'
    )
    colours, panels = _colours(found), []
    for name, mine in _by_experiment(found).items():
        spans = [span for one in mine for span in _errors(one)]
        panels.append(_bars(name, '[µm, µrad]', spans, colours, x_axis_type='log'))
    for figure_, unit in (('overshoot', '%'), ('settling', 's')):
        spans = [span for one in found for span in _of_step(one, figure_)]
        if spans:
            panels.append(_bars(f'{figure_} of steps', f'[{unit}]', spans, colours))
    return [Chart('Distributions', caption, panels)] if panels else []


def _errors(group: Group) -> Iterator[_Span]:
    for figure_, word in FIGURES.items():
        values, usual = group.figures(figure_), getattr(group.nominal, figure_)
        for axis, label in enumerate(AXES):
            if values[:, axis].max() > _LEAST:
                paper = group.experiment.published.get(label) if figure_ == 'mean' else None
                yield _Span(
                    f'{label} {word}',
                    group.law,
                    np.maximum(1e6 * values[:, axis], FLOOR),
                    max(1e6 * float(usual[axis]), FLOOR),
                    None if paper is None else 1e6 * paper,
                )


def _of_step(group: Group, name: str) -> Iterator[_Span]:
    if group.experiment.step is None or not group.survived:
        return
    values = group.figures(name)
    settled, usual = values[np.isfinite(values)], float(getattr(group.nominal, name))
    if settled.size and np.isfinite(usual):
        yield _Span(group.experiment.name, group.law, settled, usual, None)


def _bars(
    title: str, unit: str, spans: Sequence[_Span], colours: Mapping[str, str], **options: Any
) -> figure:
    several = len({span.law for span in spans}) > 1
    rows = [(span.name, span.law) if several else span.name for span in spans]
    low, middle, high = np.array([np.quantile(span.values, SHARES) for span in spans]).T
    source = ColumnDataSource(
        {
            'row': rows,
            'name': [f'{span.name}, {span.law}' for span in spans],
            'low': low,
            'middle': middle,
            'high': high,
            'least': [span.values.min() for span in spans],
            'most': [span.values.max() for span in spans],
            'nominal': [span.nominal for span in spans],
            'colour': [colours[span.law] for span in spans],
        }
    )
    panel = _row_panel(title, unit, list(dict.fromkeys(rows))[::-1], **options)
    panel.segment('least', 'row', 'most', 'row', source=source, color='colour')
    bars = panel.hbar('row', 0.6, 'high', 'low', source=source, color='colour', fill_alpha=0.35)
    panel.scatter('middle', 'row', source=source, marker='dash', angle=np.pi / 2, color='colour')
    panel.scatter('nominal', 'row', source=source, marker='diamond', size=9, color=_NOMINAL)
    published = [(span.published, row) for span, row in zip(spans, rows, strict=True)]
    crosses = [(x, row) for x, row in published if x is not None]
    if crosses:
        x, row = zip(*crosses, strict=True)
        panel.scatter(list(x), list(row), marker='x', size=9, color=_PAPER, line_width=2)
    tips = [('', '@name'), ('5 / 50 / 95 %', '@low{0.00} / @middle{0.00} / @high{0.00}')]
    tips += [('from, to', '@least{0.00}, @most{0.00}'), ('nominal', '@nominal{0.00}')]
    hover(panel, bars, tips)
    return panel


def _row_panel(title: str, unit: str, rows: Sequence[Any], **options: Any) -> figure:
    """A panel with a row for each name, from below."""
    height = 90 + 18 * len(rows)
    return Panels(unit).panel(title, '', y_range=FactorRange(*rows), height=height, **options)


def tornado(found: Sequence[tuple[Group, Sequence[tuple[str, float]]]]) -> list[Chart]:
    """Which parameters matter: their rank correlations with the error by the nominal's."""
    caption = (
        "Spearman's rank correlation of a parameter, as drawn, with the mean error of the worst "
        'axis by the nominal one: to the right, more of it makes the error larger. Between the '
        'dashed lines are 95 % of those that have no influence.'
    )
    panels = []
    for group, ranked in found:
        shown = ranked[:_SHOWN][::-1]
        if not shown:
            continue
        names = [name for name, _ in shown]
        title = f'{group.experiment.name}, {group.law}'
        panel = _row_panel(title, 'rank correlation', names)
        source = ColumnDataSource({'name': names, 'value': [value for _, value in shown]})
        bars = panel.hbar('name', 0.6, 'value', 0.0, source=source, color=COLOURS[0])
        bound = _BY_CHANCE / np.sqrt(len(group.drawn) - 1)
        for value in (-bound, bound):
            mark(panel, value, _NOMINAL)
        hover(panel, bars, [('@name', '@value{0.00}')])
        panels.append(panel)
    return [Chart('Which parameter matters', caption, panels)] if panels else []
