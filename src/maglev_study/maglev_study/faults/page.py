"""The campaign on one page."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from pathlib import Path

from maglev_study.faults.campaign import Outcome
from maglev_study.faults.draw import to_json
from maglev_study.faults.fly import Scenario
from maglev_study.faults.judge import RULES
from maglev_study.faults.programme import PHASES
from maglev_study.faults.tally import Cell, Tally
from maglev_study.faults.world import CALLS

_MOST = 300  # violations in full
_BAD = ' style="background:#fbe3de"'
_NOTES = (
    'A cell: runs · greatest speed at a stop [m/s] · longest time from when the fault showed to'
    ' when it was latched [ms] · runs with the current cut in flight; ✗ runs that broke a rule.',
    'Encoder faults show from when a counter is 0.3 mm (gaps) or 0.4 mm (x, z) off the truth.',
    'Speeds, outputs and lines are the emulated world’s own, not what the bridge believes.',
)


def describe(run: Scenario) -> str:
    """A run in words."""
    faults = []
    for fault in run.faults:
        parts = [fault.kind]
        parts += [fault.call] if fault.call else []
        parts += [f'at {",".join(map(str, fault.targets))}'] if fault.targets else []
        parts += [f'size {fault.size:g}'] if fault.size else []
        parts += [f'{fault.delay} ms later'] if fault.delay else []
        faults.append(' '.join(parts))
    where = f'{run.phase} at {run.instant:.2f}, machine {run.machine}'
    return f'{" and ".join(faults)}; {where}'


def describe_violations(outcome: Outcome) -> str:
    """What was broken, in words."""
    return '; '.join(f'({rule}) {text}' for rule, text in outcome.verdict.violations)


def render(
    tally: Tally, shrunk: Sequence[tuple[Outcome, Outcome]], words: Sequence[str], complete: bool
) -> str:
    """The whole page as HTML."""
    from maglev_monitor.report.page import bullets, header, html_table, page  # needs matplotlib

    verdict = 'fail' if tally.failures else 'pass' if complete else 'incomplete'
    number, rarest = tally.rarest()
    rules = [(str(rule), RULES[rule], str(runs)) for rule, runs in tally.by_rule().items()]
    small = [
        (str(before.run.seed), describe(after.run), describe_violations(after))
        for before, after in shrunk
    ]
    full = [
        (str(one.run.seed), describe(one.run), describe_violations(one), one.verdict.reason)
        for one in tally.failures[:_MOST]
    ]
    parts = [
        header('Fault campaign', verdict, [*words, f'rarest cell {number} times: {rarest}']),
        bullets('How to read it', _NOTES),
    ]
    if rules:
        parts += ['<h2>Rules broken</h2>', html_table(['rule', '', 'runs'], rules)]
    parts += ['<h2>Faults by phase</h2>', _cells(tally), _calls(tally)]
    if small:
        parts += ['<h2>Smallest failures</h2>', html_table(['seed', 'run', 'broken'], small)]
    if full:
        heads = ['seed', 'run', 'broken', 'as the bridge says']
        parts += [f'<h2>Failures, {len(full)} of {len(tally.failures)}</h2>']
        parts += [html_table(heads, full)]
    return page('Fault campaign', parts)


def write(
    folder: Path,
    tally: Tally,
    shrunk: Sequence[tuple[Outcome, Outcome]],
    words: Sequence[str],
    complete: bool,
) -> Path:
    """Write the page, and failures as runs to replay. Raises OSError when that cannot be."""
    from maglev_monitor.metrics.result_file import write_whole

    failures = [
        {**to_json(one.run), 'broken': [list(broken) for broken in one.verdict.violations]}
        for one in [*(after for _, after in shrunk), *tally.failures]
    ]
    write_whole(folder / 'failures.json', json.dumps(failures, indent=1) + '\n')
    path = folder / 'faults.html'
    write_whole(path, render(tally, shrunk, words, complete))
    return path


def _cells(tally: Tally) -> str:
    heads = ['fault', 'all phases', 'median found', *PHASES]
    rows = []
    for kind in tally.kinds:
        row = tally.row(kind)
        cells = [
            f'<td>{html.escape(kind)}</td>',
            _cell(row),
            f'<td>{"–" if row.median is None else f"{1e3 * row.median:.0f} ms"}</td>',
            *(_cell(tally.cell(kind, phase)) for phase in PHASES),
        ]
        rows.append(f'<tr>{"".join(cells)}</tr>')
    return _table(heads, rows)


def _calls(tally: Tally) -> str:
    kinds = [kind for kind in tally.kinds if kind.startswith('call: ')]
    if not kinds:
        return ''
    rows = [
        f'<tr><td>{call}</td>{"".join(_cell(tally.call(kind, call)) for kind in kinds)}</tr>'
        for call in CALLS
    ]
    heads = ['call', *(kind.removeprefix('call: ') for kind in kinds)]
    return '<h2>Failing calls of the vendor’s module</h2>' + _table(heads, rows)


def _table(heads: Sequence[str], rows: Sequence[str]) -> str:
    head = ''.join(f'<th>{html.escape(name)}</th>' for name in heads)
    return (
        '<div style="overflow-x:auto;font-size:.78rem"><table>'
        f'<tr>{head}</tr>{"".join(rows)}</table></div>'
    )


def _cell(cell: Cell | None) -> str:
    if cell is None:
        return '<td></td>'
    parts = [str(cell.runs), f'{cell.impact:.3f}']
    parts += [] if cell.detection is None else [f'{1e3 * cell.detection:.0f} ms']
    parts += [f'{cell.cut} cut'] if cell.cut else []
    broken = f'<br><b>✗ {cell.violations}</b>' if cell.violations else ''
    return f'<td{_BAD if cell.violations else ""}>{" · ".join(parts)}{broken}</td>'
