"""``compare``: all control laws over the same experiments, without ROS."""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from maglev_controller.laws import control_law, find_law
from maglev_model.axes import THETA, X, Y
from maglev_model.parameters import replace
from maglev_model.programs.arguments import positive
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress, add_output_options
from maglev_study.command import DONE, INTERRUPTED, command, writable
from maglev_study.comparison.contestants import Contestant, find_contestants
from maglev_study.comparison.experiments import Row, loops, steps, tracking
from maglev_study.comparison.region import Region, region
from maglev_study.comparison.table import table, to_json
from maglev_study.workers import MOST_JOBS, results


class Part(NamedTuple):
    """A part of the work on one law, done by one process."""

    law: str
    name: str
    work: Callable[..., Any]
    arguments: tuple[Any, ...]


def main() -> NoReturn:
    """Entry point of the executable ``compare``."""
    leave_with(compare)


def compare(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
    return command('compare', _parser().parse_args(arguments), _compared)


def _compared(options: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    contestants = _contestants(options)
    out = writable(options.out)
    print('the closed loop as a library, without ROS: the graph would take hours', flush=True)
    started = time.monotonic()
    try:
        rows, regions = _compare(contestants, options.quick)
    except KeyboardInterrupt:
        print('compare: interrupted', file=sys.stderr)
        return INTERRUPTED, {'out': str(out)}
    text = table(rows, regions)
    print('\n' + text + '\n', flush=True)
    from maglev_study.comparison.plot import draw_regions

    facts = {
        'quick': options.quick,
        'bandwidth': options.bandwidth,
        'overlays': [str(path) for path in options.overlay],
    }
    (out / 'comparison.txt').write_text(text + '\n', encoding='utf-8')
    found = to_json(rows, regions, facts)
    (out / 'comparison.json').write_text(found, encoding='utf-8')
    draw_regions(regions, out / 'regions.png')
    print(f'compare: done in {time.monotonic() - started:.0f} s')
    for name in ('comparison.txt', 'comparison.json', 'regions.png'):
        print(f'  {out / name}')
    return DONE, {'out': str(out), 'comparison': json.loads(found)}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='compare', description=__doc__)
    parser.add_argument('--params', type=Path, required=True, help='the folder of parameter files')
    parser.add_argument(
        '--overlay',
        type=Path,
        action='append',
        default=[],
        metavar='FILE',
        help="parameters of controller and plant over every law's own; repeatable, the last wins",
    )
    parser.add_argument('--out', type=Path, required=True, help='where the results are left')
    parser.add_argument('--quick', action='store_true', help='coarse regions, short windows')
    parser.add_argument(
        '--laws', nargs='+', default=[], metavar='NAME', help='only these (default all)'
    )
    parser.add_argument(
        '--bandwidth',
        type=positive,
        metavar='RAD_S',
        help='crossover of the laws with compensators on all axes (default: as in their files)',
    )
    add_output_options(parser)
    return parser


def _contestants(options: argparse.Namespace) -> list[Contestant]:
    found = find_contestants(options.params, options.laws, options.overlay)
    if options.bandwidth is not None:
        change = {'compensator.crossover': (options.bandwidth,) * 5}
        found = [
            dataclasses.replace(one, controller=replace(one.controller, change))
            if find_law(one.controller.law).has_crossover
            else one
            for one in found
        ]
    for one in found:
        law = control_law(one.controller)
        law.design(one.controller, 'y')
    return found


def _parts(contestants: Sequence[Contestant], quick: bool) -> Iterator[Part]:
    for one in contestants:
        yield Part(one.name, 'loops', loops, (one,))
        yield Part(one.name, 'steps', steps, (one,))
        yield Part(one.name, 'tracking', tracking, (one, 5.0 if quick else 30.0))
        for axis in (Y, X, THETA):
            yield Part(one.name, f'region {axis}', region, (one, axis, quick))


def _compare(
    contestants: Sequence[Contestant], quick: bool
) -> tuple[dict[str, list[Row]], dict[str, list[Region]]]:
    found = _run(list(_parts(contestants, quick)))
    names = [one.name for one in contestants]
    rows = {
        name: found[name, 'loops'] + found[name, 'steps'] + found[name, 'tracking']
        for name in names
    }
    regions = {name: [found[name, f'region {axis}'] for axis in (Y, X, THETA)] for name in names}
    return rows, regions


def _run(parts: Sequence[Part]) -> dict[tuple[str, str], Any]:
    """The results by law and part; the work that is left is dropped when one fails."""
    progress = Progress('compare', 'parts')
    found: dict[tuple[str, str], Any] = {}
    tasks = [(part,) for part in parts]
    jobs = min(len(os.sched_getaffinity(0)), MOST_JOBS)
    try:
        for law, name, result in results(_done, tasks, jobs=jobs):
            found[law, name] = result
            progress.tell(len(found), len(parts), f', {law}: {name}')
    finally:
        progress.end()
    return found


def _done(part: Part) -> tuple[str, str, Any]:
    return part.law, part.name, part.work(*part.arguments)


if __name__ == '__main__':
    main()
