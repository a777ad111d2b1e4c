"""What the figures of all reports are drawn with. No ROS here."""

from __future__ import annotations

import io
from typing import NamedTuple

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from maglev_model.axes import FloatArray
from maglev_monitor.metrics.curves import COLUMNS
from maglev_monitor.metrics.envelope import Envelope

REFERENCE, POSITION, ERROR, SECOND = '#9a9a9a', '#1f5fa8', '#c2452d', '#2a8a62'
STYLE = {
    'font.size': 9.0,
    'axes.grid': True,
    'axes.axisbelow': True,
    'axes.spines.top': False,
    'axes.spines.right': False,
    'grid.color': '#e6e6e6',
    'axes.titlesize': 9.5,
    'axes.titleweight': 'bold',
    'axes.titlelocation': 'left',
    'legend.frameon': False,
    'legend.fontsize': 8.0,
    'figure.constrained_layout.use': True,
}


class Plot(NamedTuple):
    """One figure of the report: its heading, what it shows, and the PNG."""

    title: str
    caption: str
    png: bytes


def to_plot(title: str, caption: str, figure: Figure) -> Plot:
    """Make the PNG of a figure, and close the figure."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format='png', dpi=120)
    plt.close(figure)
    return Plot(title, caption, buffer.getvalue())


def column(name: str, index: int) -> int:
    return int(COLUMNS[name].start) + index


def extremes(curve: Envelope, column: int) -> FloatArray:
    return np.stack([curve.low[:, column], curve.high[:, column]])


def envelope(
    panel: Axes,
    time: FloatArray,
    curve: Envelope,
    column: int,
    scale: float,
    colour: object,
    label: str,
) -> None:
    """One line through least and greatest values in turn, so that every peak is drawn."""
    both = np.stack([curve.low[:, column], curve.high[:, column]], axis=1) * scale
    panel.plot(np.repeat(time, 2), both.ravel(), color=colour, lw=1.0, label=label)
