"""The paper's Fig. 3 with the terms of phi and theta beside it. Needs matplotlib."""

from __future__ import annotations

from pathlib import Path

from matplotlib import pyplot as plt
from matplotlib.axes import Axes

from maglev_model.axes import FloatArray
from maglev_monitor.metrics.result_file import whole
from maglev_monitor.report.drawing import STYLE
from maglev_study.terms import POWERS, Terms

_STYLE = {**STYLE, 'axes.titleweight': 'normal', 'svg.hashsalt': 'terms'}
_EQUATIONS = {'a': 'air gap', 'b': 'tilt φ', 'c': 'tilt θ'}
_KEPT, _DROPPED = '-', '--'


def draw(gaps: FloatArray, largest: Terms, path: Path) -> None:
    """Draw the terms over the air gap [m], shape (n,), into a file of the kind its suffix names.

    Upper row: all terms that multiply inputs, as Fig. 3(a); lower row: the small ones, as Fig.
    3(b). Dashed: what (11) drops. Raises OSError when the file cannot be written.
    """
    with plt.rc_context(_STYLE):
        figure, panels = plt.subplots(2, 3, figsize=(11.0, 6.6), sharex=True)
        for (name, title), (upper, lower) in zip(_EQUATIONS.items(), panels.T, strict=True):
            _lines(upper, gaps, largest[name], name)
            _lines(lower, gaps, largest[name], name)
            upper.set(title=f'max |{name}_i|: {title}')
            lower.set(title='the small ones', ylim=(0.0, 1.15 * _small(name, largest[name])))
            lower.set_xlabel('air gap y [mm]')
            upper.legend(loc='upper right', ncols=3)
        for row in panels:
            row[0].set_ylabel('m/s² per A, A²')
            row[1].set_ylabel('rad/s² per A, A²')
        try:
            with whole(path) as partial:
                figure.savefig(partial, format=path.suffix[1:], dpi=130, metadata={})
        finally:
            plt.close(figure)


def _lines(panel: Axes, gaps: FloatArray, values: FloatArray, name: str) -> None:
    for index, powers in enumerate(POWERS[name]):
        if sum(powers):
            style = _KEPT if sum(powers) == 1 else _DROPPED
            panel.plot(
                1e3 * gaps,
                values[:, index],
                style,
                color=plt.get_cmap('tab10')(index),
                lw=1.3,
                label=f'{name}_{index + 1}',
            )


def _small(name: str, values: FloatArray) -> float:
    """The largest value of the terms that are dropped."""
    quadratic = [index for index, powers in enumerate(POWERS[name]) if sum(powers) == 2]
    return float(values[:, quadratic].max())
