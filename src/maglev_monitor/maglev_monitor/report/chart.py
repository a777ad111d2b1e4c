"""Interactive figures for self-contained pages: zoom, hover, linked axes. No ROS here."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from bokeh.document import Document
from bokeh.embed import components
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    CrosshairTool,
    DataRange1d,
    HoverTool,
    Range1d,
    Span,
)
from bokeh.plotting import figure
from bokeh.resources import Resources
from bokeh.transform import dodge

from maglev_model.axes import FloatArray
from maglev_model.contract.phases import Phase
from maglev_monitor.metrics.curves import COLUMNS
from maglev_monitor.metrics.envelope import Envelope

REFERENCE, POSITION, ERROR, SECOND = '#8b949e', '#1f77c9', '#d55e00', '#009e73'
COLOURS = (POSITION, ERROR, SECOND, '#cc79a7', '#e69f00', '#56b4e9', REFERENCE)
"""Told apart by colour-blind readers (Okabe and Ito, 2008), on white and on black."""

_INK, _GRID, _SHADE = '#7d8790', '#8b949e', '#56b4e9'
_HEIGHT = 230  # of a panel [px]
_LEGEND_ROOM = 0.4  # of the span of the curves, half of it above


class Chart(NamedTuple):
    """A heading, what is shown below it, and its panels, which stand in ``columns``."""

    title: str
    caption: str
    panels: Sequence[figure]
    columns: int = 2


class Column(NamedTuple):
    """A curve of an envelope: the place of its column, and what to multiply it by."""

    place: int
    scale: float


def column(name: str, index: int, scale: float = 1.0) -> Column:
    """The ``index``-th of the columns called ``name``."""
    return Column(COLUMNS[name].start + index, scale)


class Panels:
    """Makes panels over one horizontal axis: zoomed in one, all are."""

    def __init__(self, horizontal: str, **options: Any) -> None:
        self._horizontal, self._options = horizontal, options
        self._range: Any = DataRange1d(range_padding=0.02)
        self._hair = Span(dimension='height', line_color=_INK, line_width=0.7, line_dash='dotted')

    def panel(self, title: str, vertical: str, **options: Any) -> figure:
        """An empty panel."""
        made = figure(
            title=title,
            x_axis_label=self._horizontal,
            y_axis_label=vertical,
            x_range=self._range,
            sizing_mode='stretch_width',
            tools='xbox_zoom,box_zoom,xpan,xwheel_zoom,reset,save',
            active_drag='xbox_zoom',
            active_scroll=None,
            **{'height': _HEIGHT, **self._options, **options},
        )
        made.add_tools(CrosshairTool(overlay=self._hair))
        _dress(made)
        return made


def _dress(made: figure) -> None:
    """Colours that can be read on white and on black."""
    made.toolbar.logo = None
    made.toolbar.autohide = True
    made.background_fill_color = made.border_fill_color = None
    made.outline_line_color = None
    made.title.text_color = _INK
    for axis in made.axis:
        axis.axis_label_text_color = axis.major_label_text_color = _INK
        axis.axis_line_color = axis.major_tick_line_color = _INK
        axis.minor_tick_line_color = None
        axis.axis_label_text_font_style = 'normal'
    made.grid.grid_line_color = _GRID
    made.grid.grid_line_alpha = 0.25


def line(
    panel: figure, x: FloatArray, y: FloatArray, name: str, colour: str, **options: Any
) -> None:
    """One curve, which says its values where the pointer is."""
    source = ColumnDataSource({'x': x.astype(np.float32), 'y': y.astype(np.float32)})
    options = {'line_width': 1.1, **options}
    drawn = panel.line('x', 'y', source=source, color=colour, legend_label=name, **options)
    tips = [(name, '@y{0.[0000]}'), (panel.xaxis[0].axis_label, '@x{0.[000]}')]
    hover(panel, drawn, tips, mode='vline')


def hover(panel: figure, drawn: Any, tips: Sequence[tuple[str, str]], **options: Any) -> None:
    """Let what is drawn say ``tips`` where the pointer is."""
    tool = HoverTool(renderers=[drawn], tooltips=list(tips), visible=False, **options)
    panel.add_tools(tool)


def envelope(
    panel: figure, time: FloatArray, curve: Envelope, of: Column, name: str, colour: str
) -> None:
    """One curve through least and greatest values in turn, so that every peak is drawn."""
    both = np.stack([curve.low[:, of.place], curve.high[:, of.place]], axis=1)
    if curve.width == 1:
        line(panel, time, both[:, 0] * of.scale, name, colour)
    else:
        line(panel, np.repeat(time, 2), both.ravel() * of.scale, name, colour)


def magnitude(curve: Envelope, of: Column) -> FloatArray:
    """The largest absolute value of each bin, shape (n,)."""
    both = np.stack([curve.low[:, of.place], curve.high[:, of.place]])
    largest: FloatArray = np.abs(both * of.scale).max(axis=0)
    return largest


def bars(
    title: str, vertical: str, names: Sequence[str], groups: Mapping[str, Sequence[float]]
) -> figure:
    """A panel of columns, on a logarithmic scale: for each name one of each group."""
    made = figure(
        title=title,
        y_axis_label=vertical,
        x_range=list(names),
        y_axis_type='log',
        sizing_mode='stretch_width',
        tools='save',
        height=_HEIGHT,
    )
    _dress(made)
    width = 0.8 / len(groups)
    heights = [value for values in groups.values() for value in values]
    floor = 0.1 * max(min(heights), 1e-3 * max(heights))
    made.y_range = Range1d(floor, 10.0 * max(heights))  # with room for the legend
    for number, (name, values) in enumerate(groups.items()):
        place = (number + 0.5) * width - 0.4
        made.vbar(
            x=dodge('name', place, range=made.x_range),
            top='value',
            bottom=floor,
            width=0.9 * width,
            color=COLOURS[number],
            legend_label=name,
            source=ColumnDataSource({'name': list(names), 'value': list(values)}),
        )
    made.add_tools(HoverTool(tooltips=[('@name', '@value{0.[0]}')]))
    legend(made)
    return made


def level(panel: figure, value: float, colour: str = _INK, dash: str = 'dotted') -> None:
    """A horizontal line across the panel."""
    panel.add_layout(Span(location=value, line_color=colour, line_dash=dash, line_width=1))


def mark(panel: figure, value: float, colour: str) -> None:
    """A vertical line across the panel."""
    panel.add_layout(
        Span(location=value, dimension='height', line_color=colour, line_dash='dashed')
    )


def band(panel: figure, low: float, high: float) -> None:
    """Shade what lies between two values."""
    panel.add_layout(BoxAnnotation(bottom=low, top=high, fill_color=_SHADE, fill_alpha=0.12))


def shade(panel: figure, whole: Envelope, time: FloatArray) -> None:
    """Shade the tracking window."""
    tracked = np.flatnonzero(whole.first[:, COLUMNS['phase']][:, 0] == Phase.TRACK)
    if len(tracked):
        first, last = float(time[tracked[0]]), float(time[tracked[-1]])
        panel.add_layout(BoxAnnotation(left=first, right=last, fill_color=_SHADE, fill_alpha=0.08))


def legend(panel: figure, place: str = 'top_right') -> None:
    """Show the names of the curves, clear of them; a click on one hides its curve."""
    if isinstance(panel.y_range, DataRange1d):
        panel.y_range.range_padding = _LEGEND_ROOM
    panel.legend.location = place
    panel.legend.click_policy = 'hide'
    panel.legend.orientation = 'horizontal'
    panel.legend.label_text_font_size = '8pt'
    panel.legend.label_text_color = _INK
    panel.legend.background_fill_alpha = 0.0
    panel.legend.border_line_color = None
    panel.legend.padding = panel.legend.margin = 2


def no_legend(panel: figure) -> None:
    """Leave the names of the curves to the panel's title."""
    panel.legend.visible = False


def render(charts: Sequence[Chart]) -> list[str]:
    """The charts as parts of a page, their scripts included; nothing when there are none."""
    if not charts:
        return []
    panels = [panel for chart in charts for panel in chart.panels]
    document = Document()
    with document.models.freeze():  # else each panel has all before it looked through again
        for panel in panels:
            document.add_root(panel)
    script, divisions = components(panels)
    rest = iter(divisions)
    parts = [Resources(mode='inline', components=['bokeh']).render_js()]
    for chart in charts:
        inner = ''.join(f'<div>{next(rest)}</div>' for _ in chart.panels)
        parts.append(
            f'<h2>{html.escape(chart.title)}</h2>\n'
            f'<p class="caption">{html.escape(chart.caption)}</p>\n'
            f'<div class="panels columns{chart.columns}">{inner}</div>'
        )
    return [*parts, script]
