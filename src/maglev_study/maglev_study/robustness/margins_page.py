"""The guaranteed margins of a campaign's laws on its page: a table, and drawn over the range."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from bokeh.models import ColumnDataSource
from scipy.stats import spearmanr

from maglev_monitor.report.chart import COLOURS, Chart, Panels, hover, legend, line
from maglev_study.multiloop import Guarantee
from maglev_study.robustness.guarantee import DELAYS, SETS, Found, Guarantees, Place
from maglev_study.robustness.outcome import Group

NOTES = (
    'Guaranteed is the multiloop disk margin of the sampled loop of all five axes: whatever gains '
    'up or down by so much, or phases by so many degrees, in the eight currents at once (or in the '
    'six readings), for small errors, it stays stable.',
    f'Found is with which of {SETS} sets of gains, each of the eight up or down by as much, the '
    'loop is first unstable where it is guaranteed least, in lockstep: what is between the two is '
    'what the guarantee may give away.',
    'The nominal machine over gap, tilt θ and speed, on which friction depends, without effects.*; '
    'at rest the law is that of rest.',
)

HEADS = ('law', 'currents come', 'least', 'in currents', 'in readings', 'found unstable')

_LATE = {0: 'in time', 1: 'a sample late'}


def rows(found: Sequence[Guarantees]) -> list[list[str]]:
    """Of the table: the least guarantees of each law, in lockstep and a sample late."""
    told = []
    for one in found:
        for delay in DELAYS:
            worst = one.worst(delay)
            guaranteed = map(_text, (worst.current, worst.reading))
            unstable = f'±{one.unstable:.1f} dB' if delay == 0 else ''
            told.append([one.law, _LATE[delay], worst.place.text(), *guaranteed, unstable])
    return told


def _text(one: Guarantee) -> str:
    return f'±{one.gain:.1f} dB or ±{one.phase:.0f}°' if one.gain > 0.0 else 'unstable'


def words(found: Sequence[Guarantees], flown: Sequence[Group]) -> list[str]:
    """How the machines' guarantees go with how they flew, a line for each law."""
    lines = []
    for one in found:
        gains = [each.current.gain for each in one.machines if each.machine]
        scores = _scores(one.law, flown)
        errors = [scores.get(each.machine, math.nan) for each in one.machines if each.machine]
        if len(set(gains)) < 2 or len(set(errors)) < 2:
            continue
        correlation = spearmanr(gains, errors, nan_policy='omit').statistic
        lines.append(
            f'{one.law}: machines 1 to {len(gains)} are guaranteed ±{min(gains):.1f} to '
            f'±{max(gains):.1f} dB at 25 mm, moving; rank correlation with the error of the worst '
            f'axis by the nominal one {correlation:.2f}.'
        )
    return lines


def _scores(law: str, flown: Sequence[Group]) -> Mapping[int, float]:
    """The worst error by the nominal one's of each drawn machine, over all experiments."""
    worst: dict[int, float] = {}
    for group in flown:
        if group.law == law:
            for one, score in zip(group.drawn, group.score.tolist(), strict=True):
                worst[one.machine] = max(worst.get(one.machine, 0.0), score)
    return worst


def charts(found: Sequence[Guarantees], flown: Sequence[Group]) -> list[Chart]:
    """The guarantees over the range, and beside them those of the machines with how they flew."""
    if not found:
        return []
    panels = Panels('air gap [mm]')
    drawn = []
    for delay in DELAYS:
        for channel in ('current', 'reading'):
            title = f'in the {channel}s, {_LATE[delay]}'
            panel = panels.panel(title, 'guaranteed gain [± dB]')
            for colour, one in zip(COLOURS, found, strict=False):
                for places in _over_gaps(one, delay):
                    _curve(panel, places, channel, one.law, colour)
            legend(panel)
            drawn.append(panel)
    caption = 'Dashed at rest, thick when tilted.'
    made = [Chart('Guaranteed margins over the range', caption, drawn)]
    panel = Panels('guaranteed gain at 25 mm [± dB]').panel(
        'machines', 'error by nominal', y_axis_type='log'
    )
    for colour, one in zip(COLOURS, found, strict=False):
        scores = _scores(one.law, flown)
        known = [each for each in one.machines if math.isfinite(scores.get(each.machine, math.inf))]
        source = ColumnDataSource(
            {
                'x': [each.current.gain for each in known],
                'y': [scores[each.machine] for each in known],
                'name': [f'machine {each.machine}, {one.law}' for each in known],
            }
        )
        points = panel.scatter('x', 'y', source=source, color=colour, size=6)
        tips = [('', '@name'), ('guaranteed', '@x{0.00} dB'), ('error', '@y{0.00}')]
        hover(panel, points, tips)
    caption = 'Each machine that was not lost: its guarantee, and the error it flew with.'
    return [*made, Chart('Guarantees and flights', caption, [panel])]


def _over_gaps(one: Guarantees, delay: int) -> list[list[Found]]:
    """The nominal machine's along the gap, for each tilt and speed."""
    kinds: dict[tuple[float, float], list[Found]] = {}
    for each in one.over:
        if each.place.delay == delay:
            kinds.setdefault((each.place.tilt, each.place.speed), []).append(each)
    return list(kinds.values())


def _curve(panel: object, places: Sequence[Found], channel: str, law: str, colour: str) -> None:
    place: Place = places[0].place
    line(
        panel,
        np.array([1e3 * each.place.gap for each in places]),
        np.array([getattr(each, channel).gain for each in places]),
        law,
        colour,
        line_dash='solid' if place.speed else 'dashed',
        line_width=2.2 if place.tilt else 1.1,
    )
