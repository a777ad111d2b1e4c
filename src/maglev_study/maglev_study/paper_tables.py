"""``paper_tables FOLDER``: the paper's experiments, its figures beside a simulation's. No ROS here.

The folder holds a folder of runs for each law and plant, named as in :data:`CASES`, with a run for
each of its scenarios in it: ``paper/steps``, ``ours/ellipse`` and so on.
"""

from __future__ import annotations

import argparse
import html
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from maglev_model.axes import AXES
from maglev_model.paper import SCENARIOS, STEPS, TRACKING, WINDOW, PublishedStep
from maglev_model.programs.command import leave_with
from maglev_monitor.bag.analysis import Analysis, analyse
from maglev_monitor.bag.errors import BagError, refuse
from maglev_monitor.metrics.readable import angle_or_length, micro, seconds
from maglev_monitor.metrics.result_file import write_whole

ELLIPSES = tuple(TRACKING)
CASES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    'paper': ("the paper's law", SCENARIOS),
    'ours': ('ours', SCENARIOS),
    'paper_rough': ("the paper's law, rough plant", ELLIPSES),
    'ours_rough': ('ours, rough plant', SCENARIOS),
    'paper_shaped': ("the paper's law, shaped steps", ('steps',)),
}
"""Folders of runs, what law and plant they are of, and the scenarios that are flown."""

COLUMNS = tuple(CASES)[:4]
"""Those that have a column of their own; shaped steps stand below the raw ones."""
DRAWN = ('paper', 'ours')
HEADS = ('', "the paper's machine", *(CASES[case][0] for case in COLUMNS))
STEP_ROWS: Mapping[str, tuple[str, ...]] = {
    'steps as jumps: overshoot, t_s, t_enc': ('paper', '', '', ''),
    'steps rounded off over 0.2 s, likewise': ('paper_shaped', 'ours', '', 'ours_rough'),
}
"""Of each block of steps, the cases whose figures stand in :data:`COLUMNS`."""
PASS, NOT_PASSED, NOTHING = 0, 1, 2

_UNKNOWN = '–'
_NOTES = (
    "The paper's machine: its own figures, measured with its encoders; with < or > the limits of "
    'its Table III.',
    'Errors are mean |e| and, after the comma, the largest.',
    "The paper's law: its regulator (14) to (17) and published poles; with the exact inverse in "
    "place of (12), which with Table I's values misses more than the paper measured.",
    'The first two are simulated on the benchmark plant: the full model (6), (7), 10 µm encoders, '
    "7 A amplifiers, and guide friction fitted to the paper's errors. Those beside fly the rough "
    'plant, params/rough.yaml, and are told its delay, modes and voltage.',
    "Errors are those on the encoders' own scales, which on the benchmark plant are the truth; in "
    'a step against its target.',
    "The paper's law is given jumps, as on the machine; below, steps rounded off over 0.2 s and "
    'their acceleration, as ours always are. Times count from the first sample of the step.',
    't_s is the time after which |e| stays below 0.1 mm or 0.1 mrad, t_enc that after which it '
    'stays within 10 µm or 20 µrad: going there and leaving again does not count.',
)


class Run(NamedTuple):
    """One run of a case: figures and analysis, None where there are none; what is wrong."""

    case: str
    scenario: str
    result: dict[str, Any] | None
    analysis: Analysis | None
    problem: str


def load_run(folder: Path, case: str, scenario: str) -> Run:
    """Read the run ``folder/case/scenario``; what cannot be read becomes its problem."""
    path = folder / case / scenario
    try:
        result = json.loads((path / 'metrics.json').read_text(encoding='utf-8'))
        problem = '' if result['verdict'] == 'pass' else _failure(result)
    except OSError:
        return Run(case, scenario, None, None, 'it has not finished: there is no metrics.json')
    except (ValueError, KeyError, TypeError):
        return Run(case, scenario, None, None, 'its metrics.json is damaged')
    problem = problem or _missing(scenario, result)
    if case not in DRAWN:
        return Run(case, scenario, result, None, problem)
    try:
        analysis = analyse(path)
    except BagError as error:
        return Run(case, scenario, result, None, problem or str(error))
    problem = problem or ''.join(analysis.notes[:1])
    return Run(case, scenario, result, analysis, problem)


def rows(runs: Sequence[Run]) -> Iterator[tuple[str, ...]]:
    """The lines of the table, cell by cell, as :data:`HEADS`; a heading is a line of one cell."""
    found = {(run.case, run.scenario): run.result for run in runs}
    for scenario, published in TRACKING.items():
        results = [found.get((case, scenario)) for case in COLUMNS]
        yield (f'{published.title}: mean, largest |e| over {_windows(results)}',)
        for axis in AXES:
            given = published.mean_error.get(axis)
            if given is not None:
                yield axis, _as_published(axis, given), *(_errors(r, axis) for r in results)
    for title, cases in STEP_ROWS.items():
        yield (title,)
        results = [found.get((case, 'steps')) for case in cases]
        for step in STEPS:
            start, target = (angle_or_length(step.axis, end) for end in (step.start, step.target))
            published_step = f'{step.overshoot}, {step.settling_time}, {step.encoder_time}'
            yield (
                f'{step.axis}, {start.split()[0]} → {target}',
                published_step if 'paper' in cases else '',
                *(
                    _step_cell(result, step) if case else ''
                    for case, result in zip(cases, results, strict=True)
                ),
            )


def markdown(runs: Sequence[Run]) -> str:
    """The table in Markdown, ending with a line feed."""
    lines = [_markdown_row(HEADS), '|:--' + '|--:' * (len(HEADS) - 1) + '|']
    for row in rows(runs):
        cells = row if len(row) > 1 else (f'**{row[0]}**', *[''] * (len(HEADS) - 1))
        lines.append(_markdown_row(cells))
    return '\n'.join(lines) + '\n'


def render(runs: Sequence[Run]) -> str:
    """The whole page as HTML; figures are embedded, nothing is fetched."""
    from maglev_monitor.report.page import bullets, header, html_table, page, picture
    from maglev_study.paper_plots import paper_plots

    analyses: dict[str, dict[str, Analysis]] = {}
    for run in runs:
        if run.analysis is not None:
            named = analyses.setdefault(run.scenario, {})
            named[CASES[run.case][0]] = run.analysis
    failed = [_problem_line(run) for run in runs if run.problem]
    title = "The paper's experiments"
    parts = [
        header(title, 'fail' if failed else 'pass', _header_words(runs)),
        bullets('Failed', failed),
        _table_of_figures(runs),
        bullets('How to read it', _NOTES),
        *(picture(plot) for plot in paper_plots(analyses)),
        '<h2>Runs</h2>',
        html_table(['run', 'verdict', 'mode', 'measured', 'peak phase current'], _run_rows(runs)),
    ]
    return page(title, parts)


def paper_tables(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: all runs are there and passed; 1: not all, the page is written all the same; 2: there is no
    run, or the page cannot be written.
    """
    options = _parser().parse_args(arguments)
    runs = [
        load_run(options.folder, case, scenario)
        for case, (_, scenarios) in CASES.items()
        for scenario in scenarios
    ]
    if all(run.result is None for run in runs):
        example = options.folder / next(iter(CASES)) / SCENARIOS[0]
        reason = f"there is no finished run in '{options.folder}', such as '{example}'"
        return refuse('paper_tables', reason, NOTHING)
    out = options.out or options.folder
    text = markdown(runs)
    try:
        write_whole(out / 'paper_tables.md', text)
        write_whole(out / 'paper_tables.html', render(runs))
    except OSError as error:
        return refuse('paper_tables', f"cannot write to '{out}': {error.strerror}", NOTHING)
    print(text)
    for run in runs:
        if run.problem:
            print(f'paper_tables: {_problem_line(run)}', file=sys.stderr)
    print(f'page: {out / "paper_tables.html"}')
    return NOT_PASSED if any(run.problem for run in runs) else PASS


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(paper_tables)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='paper_tables', description="The paper's figures beside those of finished runs."
    )
    parser.add_argument(
        'folder',
        type=Path,
        metavar='FOLDER',
        help='with runs in it: '
        + ', '.join(f'{case}/{names[0]}' for case, (_, names) in CASES.items())
        + ' and so on',
    )
    parser.add_argument(
        '--out', type=Path, metavar='DIR', help='where the page goes (default: the folder)'
    )
    return parser


def _failure(result: Mapping[str, Any]) -> str:
    reasons = result['reasons']
    return f'{result["verdict"]}: {reasons[0]}' if reasons else str(result['verdict'])


def _missing(scenario: str, result: Mapping[str, Any]) -> str:
    """What a run of the scenario must hold and this one does not."""
    if scenario in TRACKING:
        tracked = result['axes']['y']['mean_abs_error'] is not None
        return '' if tracked else 'it tracked nothing'
    lost = [step for step in STEPS if _find(result, step) is None]
    if not lost:
        return ''
    first = f'{lost[0].axis} to {angle_or_length(lost[0].axis, lost[0].target)}'
    return f'{len(lost)} of {len(STEPS)} steps are missing, first that of {first}'


def _find(result: Mapping[str, Any], step: PublishedStep) -> Mapping[str, Any] | None:
    for found in result['own_steps'] or result['steps']:
        if found['axis'] == step.axis and all(
            abs(found[key] - value) < 1e-9
            for key, value in (('from', step.start), ('to', step.target))
        ):
            match: Mapping[str, Any] = found
            return match
    return None


def _step_cell(result: Mapping[str, Any] | None, step: PublishedStep) -> str:
    found = None if result is None else _find(result, step)
    if found is None:
        return _UNKNOWN
    times = (_two_digits(found['settling_time']), _two_digits(found['encoder_time']))
    return f'{found["overshoot_percent"]:.1f} %, {times[0]}, {times[1]}'


def _two_digits(time: float | None) -> str:
    return seconds(time) if time is None else f'{time:.2f} s'


def _errors(result: Mapping[str, Any] | None, axis: str) -> str:
    """Mean and largest |e|, in one unit."""
    found = {} if result is None else (result['own_axes'] or result['axes'])[axis]
    mean, largest = found.get('mean_abs_error'), found.get('max_abs_error')
    if mean is None or largest is None:
        return _UNKNOWN
    return f'{1e6 * mean:.1f}, {micro(axis, largest)}'


def _as_published(axis: str, value: float) -> str:
    return f'{value * 1e6:.4g} µ{"rad" if axis in ("phi", "theta") else "m"}'


def _windows(results: Sequence[Mapping[str, Any] | None]) -> str:
    """The paper's measured time, and the simulated ones where they differ."""
    times = {float(result['duration']) for result in results if result is not None}
    if all(abs(time - WINDOW) < 1e-6 for time in times):
        return f'{WINDOW:g} s'
    simulated = ' and '.join(f'{time:g}' for time in sorted(times))
    return f'{WINDOW:g} s, simulated over {simulated} s'


def _header_words(runs: Sequence[Run]) -> Iterator[str]:
    known = [run.result for run in runs if run.result is not None]
    for key in ('stage', 'mode'):
        yield ' and '.join(sorted({str(result[key]) for result in known if result[key]}))
    yield f'{sum(not run.problem for run in runs)} of {len(runs)} runs passed'


def _problem_line(run: Run) -> str:
    return f'{CASES[run.case][0]}, {run.scenario}: {run.problem}'


def _run_rows(runs: Sequence[Run]) -> Iterator[list[str]]:
    for run in runs:
        if run.result is not None:
            yield [
                f'{run.case}/{run.scenario}',
                run.result['verdict'],
                run.result['mode'],
                f'{run.result["duration"]:g} s',
                f'{run.result["currents"]["peak_phase"]:.2f} A',
            ]


def _markdown_row(cells: Sequence[str]) -> str:
    return '| ' + ' | '.join(cell.replace('|', '\\|') for cell in cells) + ' |'


def _table_of_figures(runs: Sequence[Run]) -> str:
    lines = ['<table><tr>', *(f'<th>{html.escape(head)}</th>' for head in HEADS), '</tr>']
    for row in rows(runs):
        kind, span = ('th', f' colspan="{len(HEADS)}"') if len(row) == 1 else ('td', '')
        cells = ''.join(f'<{kind}{span}>{html.escape(cell)}</{kind}>' for cell in row)
        lines.append(f'<tr>{cells}</tr>')
    return ''.join([*lines, '</table>'])
