"""``analyze BAG``: the figures of a run from its bag alone, and its report. No ROS here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from maglev_model.command import leave_with
from maglev_monitor.bag.analysis import Analysis, analyse
from maglev_monitor.bag.errors import BagError
from maglev_monitor.metrics.result_file import write_metrics
from maglev_monitor.report.terminal import as_text

PASS, NOT_PASSED, BAD_BAG = 0, 1, 2


def analyze(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: the bag is whole and its run passed; 1: it did not pass or has not reached its end; 2: the
    bag cannot be read, or is cut off (its report is written all the same).
    """
    options = _parser().parse_args(arguments)
    try:
        analysis = analyse(options.bag)
    except BagError as error:
        print(f'analyze: error: {error}', file=sys.stderr)
        return BAD_BAG
    for note in analysis.notes:
        print(f'analyze: {note}', file=sys.stderr)
    folder = options.out or _beside(options.bag)
    try:
        _write(folder, analysis)
    except OSError as error:
        print(f"analyze: error: cannot write to '{folder}': {error.strerror}", file=sys.stderr)
        return BAD_BAG
    print(as_text(analysis.result))
    print(f'report: {folder / "report.html"}')
    if analysis.notes:
        return BAD_BAG
    return PASS if analysis.result['verdict'] == 'pass' else NOT_PASSED


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
        '--out', type=Path, metavar='DIR', help='where report.html goes (default: beside the bag)'
    )
    return parser


def _beside(bag: Path) -> Path:
    """The folder of the run: that of the bag's folder, or of its file."""
    bag = bag.resolve()
    if bag.is_file():
        bag = bag.parent
    return bag if (bag / 'bag').is_dir() else bag.parent


def _write(folder: Path, analysis: Analysis) -> None:
    from maglev_monitor.report.run_report import (
        write_report,
    )  # its figures' library is slow to load

    write_report(folder / 'report.html', analysis)
    if not (folder / 'metrics.json').exists():
        write_metrics(folder / 'metrics.json', analysis.result)
