"""``robustness``: machines drawn by the hundred, each flown by each law, without ROS.

What became of them is left as a table and a page; ``--replay N`` writes the parameters of one
machine, with which the whole graph flies it.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from maglev_model.parameters import ParameterError
from maglev_model.programs.arguments import whole_number
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress, add_output_options
from maglev_study.command import DONE, INTERRUPTED, command, writable

if TYPE_CHECKING:
    from maglev_study.robustness.fleet import Campaign, Plan
    from maglev_study.robustness.fly import Flown
    from maglev_study.robustness.guarantee import Guarantees


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(run)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: all was flown; 2: wrong use, or no scheduler; 130: interrupted, what was flown is kept.
    """
    return command('robustness', _parser().parse_args(arguments), _flown)


def _flown(options: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    plan = plan_of(options, options.law)
    if options.replay is not None:
        return _write_machine(plan, options.replay, options.out)
    return _fly(plan, options)


def _fly(plan: Plan, options: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    from maglev_study.robustness.fleet import fly_plan
    from maglev_study.robustness.outcome import groups
    from maglev_study.robustness.page import survivors

    progress = Progress('robustness', 'flown')

    def heard(done: int, wanted: int, _: Sequence[Flown]) -> None:
        progress.tell(done, wanted)

    campaign = fly_plan(
        plan, options.out, jobs=options.jobs, scheduler=options.scheduler, heard=heard
    )
    progress.end()
    laws = [one.name for one in plan.contestants]
    table = survivors(groups(campaign), laws)
    for experiment, *cells in table:
        for law, cell in zip(laws, cells, strict=True):
            print(f'  {experiment:12}{law:20}{cell}')
    campaign, guaranteed, unknown = _margins(campaign, options)
    files = _leave(campaign, options, guaranteed, unknown)
    for path in files:
        print(f'  {path}')
    outcome = {
        'survivors': {row[0]: dict(zip(laws, row[1:], strict=True)) for row in table},
        'files': [str(path) for path in files],
    }
    if campaign.interrupted:
        print('robustness: interrupted; the same call with this --out goes on', file=sys.stderr)
        return INTERRUPTED, outcome
    return DONE, outcome


def _margins(
    campaign: Campaign, options: argparse.Namespace
) -> tuple[Campaign, Sequence[Guarantees], str]:
    """What the laws are guaranteed, or why that is not known; Ctrl-C interrupts the campaign."""
    from maglev_study.robustness.guarantee import guarantees

    if campaign.interrupted:
        return campaign, (), ''
    progress = Progress('robustness', 'margins')
    try:
        found = guarantees(
            campaign.plan, jobs=options.jobs, scheduler=options.scheduler, heard=progress.tell
        )
    except ParameterError as error:
        print(f'robustness: no margins: {error}')
        return campaign, (), str(error)
    except KeyboardInterrupt:
        return dataclasses.replace(campaign, interrupted=True), (), ''
    finally:
        progress.end()
    return campaign, found, ''


def _leave(
    campaign: Campaign,
    options: argparse.Namespace,
    guaranteed: Sequence[Guarantees],
    unknown: str,
) -> list[Path]:
    """Write table and page; their paths."""
    from maglev_monitor.metrics.result_file import write_whole
    from maglev_study.robustness.page import render
    from maglev_study.robustness.table import write_table

    plan = campaign.plan
    overlays = [_named(path, options.params) for path in options.overlay]
    words = [f'{plan.machines} machines, seed {plan.seed}']
    words += ['params ' + ', '.join(overlays)] if overlays else []
    words += ['laws ' + ', '.join(one.name for one in plan.contestants)]
    table, note = write_table(campaign, options.out)
    if note:
        print(f'robustness: csv in place of parquet: {note}')
    path = options.out / 'robustness.html'
    write_whole(path, render(campaign, words, _replays(plan, options), guaranteed, unknown))
    return [path, table]


def _replays(plan: Plan, options: argparse.Namespace) -> dict[str, str]:
    """By law, the command that flies a machine, but for its number."""
    call = f'scenarios/robustness.sh --seed {plan.seed}'
    for path in options.overlay:
        call += f' --params {_named(path, options.params)}'
    files = [Path(law).resolve() for law in options.law if law.endswith('.yaml')]
    given = {one.name: f' --law {one.name}' for one in plan.contestants} | {'default': ''}
    given |= {path.stem: f' --law {shlex.quote(str(path))}' for path in files}
    return {one.name: f'{call}{given[one.name]} --replay' for one in plan.contestants}


def _named(path: Path, params: Path) -> str:
    """How an overlay is named on the command line, whatever folder that is in."""
    path, params = path.resolve(), params.resolve()
    if path.parent == params:
        return shlex.quote(path.name.removesuffix('.yaml'))
    return shlex.quote(str(path))


def _write_machine(plan: Plan, number: int, out: Path) -> tuple[int, dict[str, Any]]:
    from maglev_monitor.metrics.result_file import write_whole
    from maglev_study.robustness.replayed import sections

    if len(plan.contestants) != 1:
        raise ParameterError('--replay flies under one --law')
    (contestant,) = plan.contestants
    path = out / f'machine-{number}.yaml'
    head = f'# Machine {number} of seed {plan.seed}, law {contestant.name}\n'
    write_whole(path, head + sections(plan.draw(contestant, number), contestant))
    print(f'machine {number}: {path}')
    return DONE, {'machine': number, 'files': [str(path)]}


def command_parser(name: str, about: str | None, machines: int) -> argparse.ArgumentParser:
    """Options of a command that flies machines, ``machines`` of them unless told otherwise."""
    parser = argparse.ArgumentParser(prog=name, description=about)
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
    add('--machines', type=whole_number(1, 10**6), default=machines, metavar='N', help='how many')
    add('--experiment', nargs='+', default=[], metavar='NAME', help='what is flown (default: all)')
    add('--seed', type=whole_number(0, 2**53), default=0, metavar='S', help='of all that is drawn')
    add(
        '--jobs',
        type=whole_number(1, 512),
        default=os.cpu_count() or 1,
        metavar='J',
        help='processes',
    )
    add('--scheduler', default='', metavar='ADDRESS', help='a Dask cluster, tcp://host:8786')
    add('--out', type=Path, default=Path(name), metavar='DIR', help='where results are left')
    add_output_options(parser)
    return parser


def plan_of(options: argparse.Namespace, laws: Sequence[str]) -> Plan:
    """What the options of :func:`command_parser` ask for, its folder made."""
    from maglev_study.robustness.fleet import make_plan

    plan = make_plan(
        options.params,
        options.machines,
        laws=laws,
        names=options.experiment,
        overlays=options.overlay,
        seed=options.seed,
    )
    writable(options.out)
    return plan


def _parser() -> argparse.ArgumentParser:
    parser = command_parser('robustness', __doc__, machines=200)
    add = parser.add_argument
    add('--law', nargs='+', default=['default'], metavar='NAME', help='the laws (default: default)')
    add(
        '--replay', type=whole_number(0, 10**6), metavar='N', help='write one machine for the graph'
    )
    return parser


if __name__ == '__main__':
    main()
