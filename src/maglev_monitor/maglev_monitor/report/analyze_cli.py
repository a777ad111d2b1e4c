"""``analyze BAG``: the figures of a run from its bag alone, and its report. No ROS here.

``analyze BAG OTHER`` lays two runs side by side.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.analysis import UNTOLD, Analysis, analyse
from maglev_monitor.bag.errors import BagError, refuse
from maglev_monitor.bag.reader import run_folder
from maglev_monitor.metrics.result_file import write_metrics
from maglev_monitor.report.terminal import as_text

PASS, NOT_PASSED, BAD_BAG = 0, 1, 2


def analyze(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: every bag is whole and its run passed; 1: one did not pass or has not reached its end; 2: a
    bag cannot be read, or not all of it (its report is written all the same, and says so).
    """
    options = _parser().parse_args(arguments)
    bags: list[Path] = [options.bag, *([options.other] if options.other else [])]
    try:
        analyses = [analyse(bag, Progress('analyze', '%', lines=False)) for bag in bags]
    except BagError as error:
        return refuse('analyze', error, BAD_BAG)
    notes = [note for analysis in analyses for note in analysis.notes]
    for note in notes:
        print(f'analyze: {note}', file=sys.stderr)
    folder = options.out or (Path() if options.other else run_folder(options.bag))
    try:
        page = _write(folder, bags, analyses)
    except OSError as error:
        return refuse('analyze', f"cannot write to '{folder}': {error.strerror}", BAD_BAG)
    for analysis in analyses:
        print(as_text(analysis.result))
    print(f'report: {page}')
    if any(note != UNTOLD for note in notes):
        return BAD_BAG
    passed = all(analysis.result['verdict'] == 'pass' for analysis in analyses)
    return PASS if passed else NOT_PASSED


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(analyze)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='analyze', description='Figures and report of a recorded run.'
    )
    parser.add_argument(
        'bag', type=Path, metavar='BAG', help="a run's folder, a bag, or a bag's file"
    )
    parser.add_argument(
        'other', type=Path, metavar='OTHER', nargs='?', help='another, to lay beside it'
    )
    parser.add_argument(
        '--out',
        type=Path,
        metavar='DIR',
        help='where the page goes: report.html (default: beside the bag), of two runs'
        ' two_runs.html (default: here)',
    )
    return parser


def _write(folder: Path, bags: Sequence[Path], analyses: Sequence[Analysis]) -> Path:
    """Write the page, and the figures of a single run; returns where the page is."""
    if len(analyses) > 1:
        from maglev_monitor.report.two_runs import write_two_runs

        page = folder / 'two_runs.html'
        write_two_runs(page, [str(bag) for bag in bags], analyses)
        return page
    from maglev_monitor.report.run_report import write_report  # its figures are slow to load

    page = folder / 'report.html'
    write_report(page, analyses[0])
    figures = folder / 'metrics.json'
    if not (figures.exists() and _is_of(folder, bags[0])):  # those of the run's own monitor stay
        write_metrics(figures, analyses[0].result)
    return page


def _is_of(folder: Path, bag: Path) -> bool:
    """Whether a folder is that of the run whose folder, bag or bag's file this is."""
    own, bag = folder.resolve() / 'bag', bag.resolve()
    return own.is_dir() and own in (bag / 'bag', bag, bag.parent)
