"""The figures of a run as rows, for the page and for the terminal alike. No ROS here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from maglev_model.axes import AXES
from maglev_monitor.metrics.readable import angle_or_length, micro, seconds

ERRORS = {
    'mean_abs_error': 'mean |e|',
    'rms_error': 'rms e',
    'max_abs_error': 'max |e|',
    'bias': 'bias',
}
REPEATABILITY = {
    'bidirectional': 'R',
    'reversal': 'B',
    'three_sigma': '3 s',
    'bias': 'bias',
    'accuracy': 'A',
}
"""Figures of ISO 230-2 as the standard calls them; :mod:`..metrics.repeatability` explains them."""

REPEATED = (*REPEATABILITY.values(), 'targets', 'approaches')
"""The heads of their table; approaches are the fewest that a target has from one side."""

STEPS = ('from', 'to', 'overshoot', 't_s', 't_enc')

NAMES = {'true': 'true position', 'own': "encoders' own scales", 'measured': 'as counted'}
_SAME = 1e-9  # what figures may differ by that are shown once [m, rad]


def errors(result: Mapping[str, Any]) -> Iterator[tuple[str, list[list[str]]]]:
    """Whose errors, and rows of axis and :data:`ERRORS`; own ones only if not the true ones."""
    source = result['error_source']
    shown = {source: result['axes'], 'own': result['own_axes'], 'measured': result['measured_axes']}
    if result['own_axes'] and _same(result['axes'], result['own_axes']):
        del shown['own']
    for name, axes in shown.items():
        if axes and axes['y']['mean_abs_error'] is not None:
            rows = [[axis, *(micro(axis, axes[axis][key]) for key in ERRORS)] for axis in AXES]
            yield NAMES[name], rows


def steps(result: Mapping[str, Any]) -> Iterator[tuple[str, list[list[str]]]]:
    """Whose, and rows of axis and :data:`STEPS`; own ones only if they read otherwise."""
    true = [_step(step) for step in result['steps']]
    own = [_step(step) for step in result['own_steps'] or ()]
    if true:
        yield NAMES[result['error_source']], true
    if own and own != true:
        yield NAMES['own'], own


def _step(step: Mapping[str, Any]) -> list[str]:
    axis = step['axis']
    ends = (angle_or_length(axis, step[end]) for end in ('from', 'to'))
    times = (seconds(step[time]) for time in ('settling_time', 'encoder_time'))
    return [axis, *ends, f'{step["overshoot_percent"]:.1f} %', *times]


def repeatability(result: Mapping[str, Any]) -> Iterator[tuple[str, list[list[str]]]]:
    """Whose, and rows of axis and :data:`REPEATED`, of runs that go to targets repeatedly."""
    for source, axes in result['repeatability'].items():
        rows = [
            [
                axis,
                *(micro(axis, found[key]) for key in REPEATABILITY),
                *(str(found[key]) for key in ('targets', 'approaches')),
            ]
            for axis, found in axes.items()
        ]
        yield NAMES[source], rows


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    pairs = ((one[axis][key], other[axis][key]) for axis in AXES for key in ERRORS)
    return all(a == b or (a and b and abs(a - b) < _SAME) for a, b in pairs)
