"""A campaign on one page: who survives what, by how much errors differ, why, and who is worst."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from maglev_model.axes import AXES, FloatArray
from maglev_model.paper import STEPS
from maglev_study.robustness import margins_page
from maglev_study.robustness.charts import distributions, fans, tornado
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.fleet import Campaign
from maglev_study.robustness.fly import LOST
from maglev_study.robustness.guarantee import Guarantees
from maglev_study.robustness.outcome import (
    SHARES,
    Group,
    drawn_parameters,
    groups,
    influence,
    worst,
)

NOTES = (
    'Errors are those of the position on the encoders’ own scales: what a law can do about. Where '
    'encoders do not err, that is the true position.',
    'Lost is a machine whose platen meets a stop or is given up; worse, one whose mean error of '
    'some axis is more than twice that of the nominal machine, which is as its parameter files '
    'have it; errors below 1 µm and 4 µrad count as that much.',
    'Quantiles are over the drawn machines that were not lost.',
)


def render(
    campaign: Campaign,
    words: Sequence[str],
    replays: Mapping[str, str],
    guaranteed: Sequence[Guarantees] = (),
    unknown: str = '',
) -> str:
    """The page as HTML; ``replays`` are by law the commands that fly a machine, but for its number.

    ``unknown`` is why there are no guarantees.
    """
    from maglev_monitor.report.chart import render as drawn_charts
    from maglev_monitor.report.page import bullets, header, html_table, page

    found = groups(campaign)
    laws = [one.name for one in campaign.plan.contestants]
    shares = [f'{100 * share:g} %' for share in SHARES]
    drawn = {law: drawn_parameters(campaign, law) for law in laws}
    charts = [
        *fans(found),
        *distributions(found),
        *tornado([(one, influence(one, drawn[one.law])) for one in found if one.drawn]),
    ]
    parts = [
        header('Robustness', verdict(campaign, found), words),
        bullets('How to read it', NOTES),
        '<h2>Who survives what</h2>',
        html_table(['experiment', *laws], survivors(found, laws)),
        '<h2>The worst machines</h2>',
        html_table(
            ['law', 'machine', 'experiment', 'error by nominal', '', 'to fly it'],
            _worst_rows(found, replays),
        ),
        bullets('Lost', _lost(found)),
        *_margins(guaranteed, unknown, found),
        '<h2>Figures</h2>',
        html_table(
            ['law', 'experiment', 'figure', 'nominal', *shares, 'worst', 'the paper'],
            [row for one in found for row in figures(one)],
        ),
        *drawn_charts([*charts, *margins_page.charts(guaranteed, found)]),
        '<h2>What is drawn</h2>',
        html_table(
            ['parameter', '', 'distribution', 'centre', 'width', 'source'], _draws(campaign)
        ),
    ]
    return page('Robustness', parts)


def _margins(guaranteed: Sequence[Guarantees], unknown: str, found: Sequence[Group]) -> list[str]:
    from maglev_monitor.report.page import bullets, html_table

    head = '<h2>Guaranteed margins</h2>'
    if unknown:
        return [head, bullets('Not known', [unknown])]
    if not guaranteed:
        return []
    return [
        head,
        html_table(margins_page.HEADS, margins_page.rows(guaranteed)),
        bullets('Beside the flights', margins_page.words(guaranteed, found)),
        bullets('What it says', margins_page.NOTES),
    ]


def verdict(campaign: Campaign, found: Sequence[Group]) -> str:
    """Incomplete; or pass when every machine flew, none of them worse, and every step settled."""
    if campaign.interrupted:
        return 'incomplete'
    bad = any(
        len(one.survived) < len(one.drawn) or one.worse.any() or one.unsettled for one in found
    )
    return 'fail' if bad else 'pass'


def survivors(found: Sequence[Group], laws: Sequence[str]) -> list[list[str]]:
    """For each experiment and law, how many machines survived, and how many of them are worse."""
    cells = {(one.experiment.name, one.law): _survived(one) for one in found}
    names = dict.fromkeys(one.experiment.name for one in found)
    return [[name, *(cells.get((name, law), '–') for law in laws)] for name in names]


def _survived(group: Group) -> str:
    told = [f'{len(group.survived)} of {len(group.drawn)}']
    if group.nominal.verdict == LOST:
        return f'{told[0]}, the nominal one is lost'
    told += [f'{group.worse.sum()} worse'] if group.worse.any() else []
    told += [f'{group.unsettled} unsettled'] if group.unsettled else []
    return ', '.join(told)


def figures(group: Group) -> list[list[str]]:
    """Rows of the table of figures: mean and greatest errors, overshoot, settling."""
    if not group.survived or group.nominal.verdict == LOST:
        return []
    rows = []
    for name, word in (('mean', 'mean'), ('peak', 'greatest')):
        values = group.figures(name)
        for axis, label in enumerate(AXES):
            if values[:, axis].max() < 1e-9:
                continue
            unit = 'µrad' if axis >= 3 else 'µm'
            paper = group.experiment.published.get(label) if name == 'mean' else None
            rows.append(
                _row(
                    group,
                    f'{word} |e| of {label} [{unit}]',
                    1e6 * getattr(group.nominal, name)[axis],
                    1e6 * values[:, axis],
                    '' if paper is None else f'{1e6 * paper:.1f}',
                )
            )
    step = group.experiment.step
    if step is not None:
        said = {one[:3]: (one.overshoot, one.settling_time) for one in STEPS}
        papers = said.get((AXES[step.axis], step.start, step.end), ('', ''))
        for name, unit, told in zip(('overshoot', 'settling'), ('%', 's'), papers, strict=True):
            values, nominal = group.figures(name), getattr(group.nominal, name)
            rows.append(_row(group, f'{name} [{unit}]', nominal, values, told))
    return rows


def _row(group: Group, what: str, nominal: float, values: FloatArray, paper: str) -> list[str]:
    shown = [nominal, *np.quantile(values, SHARES, method='nearest'), values.max()]
    return [group.law, group.experiment.name, what, *(f'{one:.3g}' for one in shown), paper]


def _worst_rows(found: Sequence[Group], replays: Mapping[str, str]) -> list[list[str]]:
    rows = []
    for law, replay in replays.items():
        one = worst(found, law)
        if one is not None:
            score = 'lost' if math.isinf(one.score) else f'{one.score:.2f}'
            machine = str(one.machine)
            rows.append([law, machine, one.experiment, score, one.what, f'{replay} {machine}'])
    return rows


def _lost(found: Sequence[Group]) -> list[str]:
    lines = []
    for group in found:
        lost = [one for one in group.flown if one.verdict == LOST]
        numbers = ', '.join(
            'nominal' if one.machine == NOMINAL else str(one.machine) for one in lost[:20]
        )
        more = f' and {len(lost) - 20} more' if len(lost) > 20 else ''
        if lost:
            told = f'{group.law}, {group.experiment.name}: {numbers}{more}'
            lines.append(f'{told}; the first: {lost[0].reason}')
    return lines


def _draws(campaign: Campaign) -> list[list[str]]:
    rows = []
    for by, name, (kind, centre, width, source) in map(dataclasses.astuple, campaign.plan.draws):
        rows.append([name, by, kind, f'{centre:g}', f'{width:g}', source])
    return rows
