"""What the errors of a tracked path are made of: their spectrum, and their peaks. No ROS here."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from maglev_model.axes import AXES, FloatArray
from maglev_monitor.bag.analysis import Analysis
from maglev_monitor.report.chart import (
    COLOURS,
    ERROR,
    Chart,
    Panels,
    column,
    legend,
    line,
    no_legend,
)
from maglev_monitor.report.scales import MOVES, units

_WINDOW = 1.024  # a segment of the spectrum [s]
_LEAST_TAIL = 0.512  # of tracking that gives a spectrum [s]


def spectrum(analysis: Analysis) -> Chart | None:
    """Amplitude spectral density of each error (Welch's method), or None when tracking is short."""
    sequence, values = analysis.curves.tail
    source, rate = analysis.result['error_source'], 1.0 / analysis.run.sample_time
    window, least = round(_WINDOW * rate), round(_LEAST_TAIL * rate)
    if len(sequence) < least:
        return None
    panels = Panels('frequency [Hz]', x_axis_type='log', y_axis_type='log', height=300)
    drawn, slowest = [], 0.0
    for axes, unit in (((0, 1, 2), 'µm'), ((3, 4), 'µrad')):
        panel = panels.panel('', f'[{unit}/√Hz]')
        for colour, index in zip(COLOURS, axes, strict=False):
            error = 1e6 * _unbroken(sequence, values[:, column(f'{source}_error', index).place])
            if len(error) < least or np.ptp(error) == 0.0:
                continue
            frequency, power = signal.welch(error, rate, nperseg=min(window, len(error)))
            slowest = max(slowest, float(frequency[1]))
            line(panel, frequency[1:], np.sqrt(power[1:]), AXES[index], colour)
        if panel.renderers:
            legend(panel)
            drawn.append(panel)
    if not drawn:
        return None
    caption = (
        'Amplitude spectral density of the errors over the longest stretch of the figure above in '
        'which no sample is missing: integrated over the frequency, its square is the variance of '
        f'what is faster than {slowest:.2g} Hz.'
    )
    return Chart('Spectrum of the errors', caption, drawn)


def _unbroken(sequence: NDArray[np.int64], values: FloatArray) -> FloatArray:
    """The longest part of values (n,) in which none is missing: a spectrum wants even samples."""
    known = np.flatnonzero(np.isfinite(values))
    gaps = np.flatnonzero(np.diff(sequence[known]) != 1) + 1
    return max(np.split(values[known], gaps), key=len)


def reversals(analysis: Analysis) -> Chart | None:
    """Errors against the velocity asked for: friction shows as a jump where that changes sign."""
    sequence, values = analysis.curves.tail
    source, drawn = analysis.result['error_source'], []
    for index, axis in enumerate(AXES):
        wanted = values[:, column('reference', index).place]
        if len(sequence) < 2 or np.ptp(wanted) < MOVES:
            continue
        milli, micro = units(axis)
        velocity = np.gradient(wanted, sequence * analysis.run.sample_time)
        panel = Panels(f'velocity of the reference [{milli}/s]').panel(axis, f'e [{micro}]')
        error = 1e6 * values[:, column(f'{source}_error', index).place]
        line(panel, 1e3 * velocity, error, 'e', ERROR, line_width=0.8)
        no_legend(panel)
        drawn.append(panel)
    if not drawn:
        return None
    caption = (
        'The errors of the figure above against the velocity asked for. What friction leaves '
        'stands where the velocity passes zero; what rises with the velocity is a lag.'
    )
    return Chart('Reversal peaks', caption, drawn, columns=3)
