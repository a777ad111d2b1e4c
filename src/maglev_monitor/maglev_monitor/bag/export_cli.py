"""``export BAG``: a run for other programs, as csv, parquet, mat or npz. No ROS here."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from maglev_model.programs.command import leave_with
from maglev_model.programs.optional import MissingLibraryError
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.columns import table
from maglev_monitor.bag.errors import BagError, refuse
from maglev_monitor.bag.export import FORMATS, write
from maglev_monitor.bag.reader import run_folder

DONE, FAILED = 0, 2


def export(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: the run is written; 2: the bag cannot be read, or the file not be written.
    """
    options = _parser().parse_args(arguments)
    form, out = options.format, options.out
    if form is None:
        form = out.suffix[1:] if out and out.suffix[1:] in FORMATS else 'csv'
    if out == Path('-'):
        return refuse('export', "'-' is no file, and no run goes to a pipe", FAILED)
    out = out or run_folder(options.bag) / f'samples.{form}'
    try:
        found = table(options.bag, Progress('export: read', '%', lines=False))
        written = Progress('export: written', '%', lines=False)
        files = write(found, out, form, written)
    except (BagError, MissingLibraryError) as error:
        return refuse('export', error, FAILED)
    except OSError as error:
        return refuse('export', f"cannot write '{out}': {error.strerror}", FAILED)
    for note in found.notes:
        print(f'export: {note}', file=sys.stderr)
    print(f'{len(found.columns["sample"])} samples, {len(found.columns)} columns')
    for file in files:
        print(f'  {file}')
    return DONE


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(export)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='export', description='Write a recorded run for other programs, one row a sample.'
    )
    parser.add_argument(
        'bag', type=Path, metavar='BAG', help="a run's folder, a bag, or a bag's file"
    )
    parser.add_argument(
        '--format', choices=tuple(FORMATS), help="(default: that of FILE's suffix, or csv)"
    )
    parser.add_argument(
        '--out', type=Path, metavar='FILE', help='(default: samples.FORMAT beside the bag)'
    )
    return parser
