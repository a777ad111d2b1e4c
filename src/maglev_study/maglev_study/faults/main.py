"""``faults``: faults of encoders, boards, amplifiers, controller and process, in every phase.

Flies the real bridge on emulated boards, in lockstep and without ROS, against machines that differ
from what is believed of them, and judges each run by what truly happened.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

from maglev_model.compiled.sources import sources_digest
from maglev_model.parameters import ParameterError, differing
from maglev_model.programs.arguments import whole_number
from maglev_model.programs.command import leave_with
from maglev_model.programs.progress import Progress, add_output_options
from maglev_study.command import INTERRUPTED, command, writable
from maglev_study.faults.campaign import Campaign, Outcome
from maglev_study.faults.draw import cells, from_json, scenario
from maglev_study.faults.fly import Scenario
from maglev_study.faults.judge import RULES
from maglev_study.faults.machines import Believed, believed
from maglev_study.faults.page import describe, describe_violations, write
from maglev_study.faults.tally import Tally
from maglev_study.journal import Journal

PASS, BROKEN = 0, 1

_RUNS = 3000
_SHRUNK = 12  # failures, of different kinds
_MOST_RUNS = 10_000_000


def main() -> NoReturn:
    """Entry point of the executable."""
    leave_with(run)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code.

    0: all rules hold; 1: some do not; 2: wrong use; 130: interrupted, the page tells what was done.
    What is flown is kept as it comes: the same call with its ``--out`` goes on, also after a kill.
    """
    return command('faults', _parser().parse_args(arguments), _flown)


def _flown(options: argparse.Namespace) -> tuple[int, dict[str, Any]]:
    options.out, given = writable(options.out), believed(*options.overlay)
    if options.replay is not None:
        return _replay(_run_of(options.replay, options.double), given, options.out)
    number = len(cells()) if options.short else options.runs
    runs = [
        scenario(seed, double=options.double) for seed in range(options.seed, options.seed + number)
    ]
    with _journal(options, given) as journal:
        return _fly(runs, given, options, journal)


def _fly(
    runs: Sequence[Scenario],
    given: Believed,
    options: argparse.Namespace,
    journal: Journal[Outcome],
) -> tuple[int, dict[str, Any]]:
    started = time.monotonic()
    flown = {one.run.seed: one for one in journal.flown}
    outcomes = [flown[run.seed] for run in runs if run.seed in flown]
    missing = [run for run in runs if run.seed not in flown]
    shrunk: list[tuple[Outcome, Outcome]] = []

    progress = Progress('faults', 'runs')
    progress.tell(len(outcomes), len(runs))

    def heard(new: list[Outcome]) -> None:
        journal.add(new)
        outcomes.extend(new)
        broken = sum(bool(one.verdict.violations) for one in outcomes)
        progress.tell(len(outcomes), len(runs), f', {broken} with a rule broken')

    def report() -> Path:
        spent = time.monotonic() - started
        words = [f'{len(outcomes)} of {len(runs)} runs', f'{spent:.0f} s']
        words += [f'{options.jobs} processes', f'seeds {runs[0].seed} to {runs[-1].seed}']
        words += [f'params {path.name}' for path in options.overlay]
        return write(options.out, tally, shrunk, words, len(outcomes) == len(runs))

    with Campaign(options.jobs, given) as campaign:
        campaign.fly(missing, heard)
        progress.end()
        tally = Tally(sorted(outcomes, key=lambda one: one.run.seed))
        path = report()
        examples = tally.examples()[:_SHRUNK]
        if examples and not campaign.interrupted:
            print(f'faults: making {len(examples)} failures smaller', flush=True)
            campaign.shrink(examples, shrunk.append)
            path = report()
    _tell(tally, shrunk, path)
    outcome = {
        'runs': len(tally.outcomes),
        'wanted': len(runs),
        'broken': {str(rule): number for rule, number in tally.by_rule().items()},
        'seeds': [one.run.seed for one in tally.failures],
        'page': str(path),
    }
    if campaign.interrupted:
        print('faults: interrupted; the same call with this --out goes on', file=sys.stderr)
        return INTERRUPTED, outcome
    return BROKEN if tally.failures else PASS, outcome


def _tell(tally: Tally, shrunk: Sequence[tuple[Outcome, Outcome]], path: Path) -> None:
    for kind in tally.kinds:
        row = tally.row(kind)
        mark = f'  {row.violations} BROKEN' if row.violations else ''
        print(f'  {kind:28}{row.runs:6} runs  {row.impact:6.3f} m/s{mark}')
    for rule, number in tally.by_rule().items():
        print(f'rule {rule} ({RULES[rule]}): broken in {number} runs')
    for before, after in shrunk:
        print(f'seed {before.run.seed}: {describe(after.run)}: {describe_violations(after)}')
    number, rarest = tally.rarest()
    print(f'faults: {len(tally.outcomes)} runs, {len(tally.failures)} broke a rule;', end=' ')
    print(f'the rarest cell ({rarest}) was flown {number} times')
    print(f'page: {path}')


def _replay(run: Scenario, given: Believed, out: Path) -> tuple[int, dict[str, Any]]:
    from maglev_monitor.metrics.result_file import write_whole
    from maglev_study.faults.replay import draw, replay

    record = replay(run, given)
    path = out / f'run-{run.seed}.html'
    write_whole(path, draw(record))
    verdict = record.verdict
    print(describe(run))
    for name, at in record.marks.items():
        print(f'  {name}: {at:g} ms after the beginning')
    print(f'  {verdict.ended}, {verdict.impact:.4f} m/s at a stop')
    print(f'  the bridge: {verdict.reason or "no fault"}')
    for rule, text in verdict.violations:
        print(f'  broken: rule {rule}: {text}')
    print(f'page: {path}')
    broken = [f'rule {rule}: {text}' for rule, text in verdict.violations]
    outcome = {'seed': run.seed, 'broken': broken, 'impact': verdict.impact, 'page': str(path)}
    return BROKEN if broken else PASS, outcome


def _run_of(text: str, double: bool) -> Scenario:
    """The run of a seed, or the first of a file. Raises ParameterError for what is neither."""
    if text.isdecimal():
        return scenario(int(text), double=double)
    try:
        plain = json.loads(Path(text).read_text(encoding='utf-8'))
        return from_json(plain[0] if isinstance(plain, list) else plain)
    except OSError as error:
        raise ParameterError(
            f"--replay is '{text}', neither a seed nor a file that is there"
        ) from error
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise ParameterError(f"--replay: '{text}' holds no run: {error!r}") from error


def _journal(options: argparse.Namespace, given: Believed) -> Journal[Outcome]:
    """What was flown into a folder; its seeds tell the runs. Raises ParameterError, OSError."""
    params = [{name: value for name, (value, _) in differing(table).items()} for table in given]
    head = {
        'code': sources_digest(),
        'double': options.double,
        'params': json.dumps(params),
    }
    read = functools.partial(Outcome.from_json, double=options.double)
    return Journal(options.out / 'flown.jsonl', head, Outcome.to_json, read)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='faults', description=__doc__)
    cores = os.cpu_count() or 1
    add = parser.add_argument
    add('--runs', type=whole_number(1, _MOST_RUNS), default=_RUNS, metavar='N', help='how many')
    add(
        '--seed',
        type=whole_number(0, 2**53),
        default=0,
        metavar='S',
        help='of the first; they count up',
    )
    add('--jobs', type=whole_number(1, 512), default=cores, metavar='J', help='processes')
    add('--double', action='store_true', help='a second fault up to 0.5 s after the first')
    add('--short', action='store_true', help='one run of each cell of fault and phase')
    add('--replay', metavar='SEED|FILE', help='fly one run alone, and draw it')
    add(
        '--overlay',
        type=Path,
        action='append',
        default=[],
        metavar='FILE',
        help='parameters of bridge and controller, repeatable',
    )
    add('--out', type=Path, default=Path('faults'), metavar='DIR', help='where the page is left')
    add_output_options(parser)
    return parser


if __name__ == '__main__':
    main()
