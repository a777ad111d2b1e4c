"""``robustness``: machines drawn by the hundred, each flown by each law, without ROS.

What became of them is left as a table and a page; ``--replay N`` writes the parameters of one
machine, with which the whole graph flies it.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from maglev_model.optional import MissingLibraryError
from maglev_model.parameters import ParameterError

if TYPE_CHECKING:
    from maglev_study.robustness.fleet import Campaign, Plan
    from maglev_study.robustness.fly import Flown

DONE, WRONG_USE, INTERRUPTED = 0, 2, 130

_PERIOD = 2.0  # least time between lines on progress [s]


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of the executable; its exit code.

    0: all was flown; 2: wrong use, or no scheduler; 130: interrupted, what was flown is kept.
    """
    options = _parser().parse_args(arguments)
    for name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
        os.environ.setdefault(name, '1')  # before NumPy: its libraries read it once
    from maglev_study.robustness.fleet import make_plan

    try:
        plan = make_plan(
            options.params,
            options.machines,
            laws=options.law,
            overlays=options.overlay,
            seed=options.seed,
        )
        options.out.mkdir(parents=True, exist_ok=True)
        if options.replay is not None:
            return _write_machine(plan, options.replay, options.out)
        return _fly(plan, options)
    except (ParameterError, MissingLibraryError) as error:
        reason = str(error)
    except OSError as error:
        reason = error.strerror or str(error)
    print(f'robustness: error: {reason}', file=sys.stderr)
    return WRONG_USE


def _fly(plan: Plan, options: argparse.Namespace) -> int:
    from maglev_study.robustness.fleet import fly_plan
    from maglev_study.robustness.outcome import groups
    from maglev_study.robustness.page import survivors

    progress = _Progress()
    campaign = fly_plan(
        plan, options.out, jobs=options.jobs, scheduler=options.scheduler, heard=progress
    )
    laws = [one.name for one in plan.contestants]
    for experiment, *cells in survivors(groups(campaign), laws):
        for law, cell in zip(laws, cells, strict=True):
            print(f'  {experiment:12}{law:20}{cell}')
    for path in _leave(campaign, options):
        print(f'  {path}')
    if campaign.interrupted:
        print('robustness: interrupted; the same call with this --out goes on', file=sys.stderr)
        return INTERRUPTED
    return DONE


def _leave(campaign: Campaign, options: argparse.Namespace) -> list[Path]:
    """Write table and page; their paths."""
    from maglev_monitor.report.page import write_page
    from maglev_study.robustness.page import render
    from maglev_study.robustness.table import write_table

    plan = campaign.plan
    overlays = [path.stem for path in options.overlay]
    words = [f'{plan.machines} machines, seed {plan.seed}']
    words += ['params ' + ', '.join(overlays)] if overlays else []
    words += ['laws ' + ', '.join(one.name for one in plan.contestants)]
    call = ['scenarios/robustness.sh', f'--seed {plan.seed}']
    call += [f'--params {name}' for name in overlays]
    table, note = write_table(campaign, options.out)
    if note:
        print(f'robustness: csv in place of parquet: {note}')
    path = options.out / 'robustness.html'
    write_page(path, render(campaign, words, ' '.join(call)))
    return [path, table]


def _write_machine(plan: Plan, number: int, out: Path) -> int:
    from maglev_model.parameters import to_yaml
    from maglev_monitor.report.page import write_page

    if len(plan.contestants) != 1:
        raise ParameterError('--replay flies under one --law')
    (contestant,) = plan.contestants
    drawn = plan.draw(contestant, number)
    path = out / f'machine-{number}.yaml'
    tables = to_yaml(drawn.plant, 'plant'), to_yaml(contestant.controller, 'controller')
    write_page(path, f'# Machine {number} of seed {plan.seed}, law {contestant.name}\n')
    with path.open('a', encoding='utf-8') as file:
        file.writelines(tables)
    print(f'machine {number}: {path}')
    return DONE


class _Progress:
    """One line now and then."""

    def __init__(self) -> None:
        self._started = time.monotonic()
        self._told = 0.0
        self._first = -1

    def __call__(self, done: int, wanted: int, new: Sequence[Flown]) -> None:
        """Hear of what has been flown."""
        if self._first < 0:
            self._first = done
        now = time.monotonic()
        if now - self._told < _PERIOD and done < wanted:
            return
        self._told = now
        spent, fresh = now - self._started, done - self._first
        left = f', about {spent / fresh * (wanted - done):.0f} s left' if fresh else ''
        print(f'robustness: {done} of {wanted} flown, {spent:.0f} s{left}', flush=True)


def _number(low: int, high: int) -> type[int]:
    def check(text: str) -> int:
        if not text.isdecimal() or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"'{text}' is no whole number from {low} to {high}")
        return int(text)

    return check  # type: ignore[return-value]


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='robustness', description=__doc__)
    add = parser.add_argument
    add('--params', type=Path, required=True, help='the folder of parameter files')
    add(
        '--overlay',
        type=Path,
        action='append',
        default=[],
        metavar='FILE',
        help="parameters of plant, controller and distributions over every law's own; repeatable",
    )
    add('--machines', type=_number(1, 10**6), default=200, metavar='N', help='how many')
    add('--law', nargs='+', default=['default'], metavar='NAME', help='the laws (default: default)')
    add('--seed', type=_number(0, 2**53), default=0, metavar='S', help='of the machines')
    add('--jobs', type=_number(1, 512), default=os.cpu_count() or 1, metavar='J', help='processes')
    add('--scheduler', default='', metavar='ADDRESS', help='a Dask cluster, tcp://host:8786')
    add('--replay', type=_number(0, 10**6), metavar='N', help='write one machine for the graph')
    add('--out', type=Path, default=Path('robustness'), metavar='DIR', help='where results are')
    return parser


if __name__ == '__main__':
    sys.exit(main())
