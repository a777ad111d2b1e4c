#!/usr/bin/env python3
"""Which small changes of the code do the tests let through?

    python benchmarks/mutants.py [--modules NAME...] [--mutants N] [--seed S] [--jobs J]

Copies the tree, changes one thing at a time in the copy (a comparison, a sign, an operator, a
constant by a fifth, a truth value, two arguments swapped, a statement dropped), and runs the tests
that look at the module until one fails, those that import it first, the fault campaign of the tests
last (with MAGLEV_ALL_CELLS=1: its whole short form). Compiled code is kept except where it stands
on what was changed. A mutant that no test notices is printed as a difference; the exit code is 1
when more than a twentieth of them survive.
"""

from __future__ import annotations

import concurrent.futures
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from mutation import (
    ALLOWED,
    INTERRUPTED,
    ROOT,
    Mutant,
    bridge_tests,
    difference,
    edits_of,
    heed_signals,
    kill,
    mutant_of,
    parser_for,
    path_of,
)

_CAMPAIGN = ('test/study/faults/test_campaign.py',)
_BRIDGE = (
    *bridge_tests('encoders', 'leaps', 'doubt', 'roll_call', 'standing_still', 'watch'),
    *bridge_tests('observer', 'board', 'way_down', 'unseen', 'rough_rig', 'amplifiers', 'guard'),
    *bridge_tests('knock', 'gap_knock', 'resting', 'life_cycle', 'memory', 'landing'),
    'test/model/contract/test_stage.py',
    *bridge_tests('faults', 'sensing', 'driver_calls', 'lines_and_offsets', 'boards_that_fail'),
    'test/study/faults/test_judge.py',
    *bridge_tests('controllers', 'commission'),
)
_CONTROLLER = ('test/controller', 'test/study/test_closed_loop_figures.py')
_INVERSE = ('test/model', 'test/reference/test_currents.py', 'test/study/test_single_motor.py')

LOOKED_AT_BY: dict[str, tuple[tuple[str, ...], ...]] = {
    **{
        f'maglev_hw_bridge.{name}': (_BRIDGE, _CAMPAIGN)
        for name in (
            *('sensing.guard', 'sensing.leaps', 'sensing.standing_still', 'sensing.observer'),
            *('sensing.knock', 'sensing.gap_knock', 'landing', 'stage', 'life_cycle'),
            *('amplifiers', 'encoders'),
            *('board', 'drivers.quanser'),
        )
    },
    'maglev_controller.supervision': (_CONTROLLER, _CAMPAIGN),
    'maglev_controller.landing': (_CONTROLLER, _CAMPAIGN),
    'maglev_model.contract.controller_watch': (
        ('test/model/contract/test_controller_watch.py', 'test/node'),
    ),
    'maglev_model.inverse': ((*_INVERSE, *_CONTROLLER), _CAMPAIGN),
}
"""Modules, and the tests that look at them, stage by stage, the fastest first."""


class Outcome(NamedTuple):
    """What became of a mutant."""

    mutant: Mutant
    survived: bool
    seconds: float


def _imports(text: str) -> str:
    """The lines of a source that import something."""
    return '\n'.join(re.findall(r'^.*import.*$', text, re.M))


def _standing_on(module: str) -> set[str]:
    """File names, without suffix, of the modules that import a module, themselves or by others."""
    sources = {
        '.'.join(path.relative_to(ROOT / 'src').with_suffix('').parts[1:]): path.read_text()
        for path in (ROOT / 'src').glob('*/maglev_*/**/*.py')
    }
    reached, front = {module}, {module}
    while front:
        wanted = re.compile('|'.join(rf'\b{re.escape(name)}\b' for name in front))
        front = {
            name
            for name, text in sources.items()
            if name not in reached and wanted.search(_imports(text))
        }
        reached |= front
    return {name.rsplit('.', 1)[-1] for name in reached}


class Copy:
    """A copy of the tree, with compiled code and a ROS domain of its own."""

    def __init__(self, where: Path, domain: int) -> None:
        self.where = where
        self.ended = False
        self._running: subprocess.Popen[bytes] | None = None
        self._cache, self._warm = where / 'numba', where / 'warm'
        listed = subprocess.run(
            ['git', '-C', ROOT, 'ls-files', '-z', '--cached', '--others', '--exclude-standard'],
            check=True,
            capture_output=True,
            text=True,
        ).stdout.split('\0')
        for name in filter(None, listed):
            if (ROOT / name).exists():
                target = where / name
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, target, follow_symlinks=False)
        self._cache.mkdir()
        packages = ':'.join(str(path) for path in sorted((where / 'src').iterdir()))
        self._environment = os.environ | {
            'PYTHONPATH': f'{packages}:{os.environ.get("PYTHONPATH", "")}',
            'NUMBA_CACHE_DIR': str(self._cache),
            'ROS_DOMAIN_ID': str(domain),
            'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1',
            'PYTHONDONTWRITEBYTECODE': '1',
            'HYPOTHESIS_STORAGE_DIRECTORY': str(where / 'hypothesis'),
        }

    def test(self, tests: Iterable[str | Path], limit: float | None = None) -> bool:
        """Whether all tests pass, in time."""
        command = [sys.executable, '-m', 'pytest', '-q', '-x', '-p', 'hypothesispytest']
        with subprocess.Popen(
            [*command, '-p', 'no:cacheprovider', '-m', 'not real_time and not long', *tests],
            cwd=self.where,
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        ) as process:
            self._running = process
            try:
                return not self.ended and process.wait(limit) == 0
            except subprocess.TimeoutExpired:
                return False
            finally:
                kill(process.pid)

    def end(self) -> None:
        """Test nothing any more: what is under way fails at once."""
        self.ended = True
        if self._running is not None:
            kill(self._running.pid)

    def warm_up(self, tests: tuple[str, ...]) -> float:
        """Compile what the unchanged tests need; returns how long tests and compiler took [s].

        Raises SystemExit when they fail.
        """
        begin = time.monotonic()
        if not self.test(tests):
            sys.exit(f'mutants: without any change these tests fail: {" ".join(tests)}')
        shutil.copytree(self._cache, self._warm, dirs_exist_ok=True)
        return time.monotonic() - begin

    def _ordered(self, module: str, tests: tuple[str, ...]) -> list[Path]:
        """The files of tests, those first that import a module."""
        name = re.compile(rf'\b{module.rsplit(".", 1)[-1]}\b')
        places = (self.where / test for test in tests)
        files = [path for place in places for path in sorted(place.rglob('test_*.py')) or [place]]
        return sorted(files, key=lambda path: not name.search(_imports(path.read_text())))

    def judge(self, mutant: Mutant, limit: float) -> Outcome:
        """Run the tests on a mutant, until one fails or a stage takes longer than ``limit`` [s]."""
        begin = time.monotonic()
        shutil.rmtree(self._cache, ignore_errors=True)
        shutil.copytree(self._warm, self._cache)
        stale = _standing_on(mutant.module)
        for compiled in self._cache.rglob('*.nb?'):
            if compiled.name.split('.')[0] in stale:
                compiled.unlink()
        path = path_of(mutant.module, self.where)
        original = path.read_text()
        path.write_text(mutant.source)
        try:
            stages = LOOKED_AT_BY[mutant.module]
            survived = all(self.test(self._ordered(mutant.module, each), limit) for each in stages)
        finally:
            path.write_text(original)
            shutil.copystat(path_of(mutant.module, ROOT), path)
        return Outcome(mutant, survived, time.monotonic() - begin)


def run(modules: list[str], number: int, seed: int, jobs: int) -> tuple[list[Outcome], bool]:
    """Judge ``number`` mutants, drawn evenly from all of the modules'; whether none was left."""
    every = [(module, one) for module in modules for one in range(len(edits_of(module)[1]))]
    drawn = [mutant_of(*one) for one in random.Random(seed).sample(every, min(number, len(every)))]
    print(f'{len(drawn)} of {len(every)} mutants of {len(modules)} modules', flush=True)
    stages = {stage for module in modules for stage in LOOKED_AT_BY[module]}
    with tempfile.TemporaryDirectory(prefix='maglev-mutants') as folder:
        first = int(os.environ.get('ROS_DOMAIN_ID') or 0)
        copies = [Copy(Path(folder, str(job)), (first + job) % 200) for job in range(jobs)]
        outcomes: list[Outcome] = []

        def work(copy: Copy, share: list[Mutant]) -> None:
            for mutant in share:
                outcome = copy.judge(mutant, 60.0 + 2.0 * took)
                if copy.ended:
                    return
                outcomes.append(outcome)
                if outcome.survived:
                    print(f'\nsurvived: {mutant.module}:{mutant.line}')
                    print(difference(mutant), flush=True)
                print(f'\r{len(outcomes)}/{len(drawn)}', end='', file=sys.stderr, flush=True)

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            try:
                took = max(pool.map(lambda copy: max(map(copy.warm_up, stages)), copies))
                list(pool.map(work, copies, [drawn[job::jobs] for job in range(jobs)]))
            except KeyboardInterrupt:
                print('\nmutants: interrupted', file=sys.stderr)
                for copy in copies:
                    copy.end()
    return outcomes, len(outcomes) == len(drawn)


def main() -> int:
    """Entry point."""
    parser = parser_for(__doc__, LOOKED_AT_BY)
    parser.add_argument('--mutants', type=int, default=200, metavar='N')
    parser.add_argument('--seed', type=int, default=1, metavar='S')
    given = parser.parse_args()
    heed_signals()
    outcomes, complete = run(given.modules, given.mutants, given.seed, given.jobs)
    print()
    for module in given.modules:
        its = [outcome for outcome in outcomes if outcome.mutant.module == module]
        lived = sum(outcome.survived for outcome in its)
        print(f'{module:40} {len(its):4} mutants, {lived:3} survived')
    lived = sum(outcome.survived for outcome in outcomes)
    judged = max(len(outcomes), 1)
    share, spent = lived / judged, sum(outcome.seconds for outcome in outcomes)
    print(f'{lived} of {len(outcomes)} survived: {100 * share:.1f} %, ', end='')
    print(f'{spent / judged:.0f} s each')
    return int(share > ALLOWED) if complete else INTERRUPTED


if __name__ == '__main__':
    sys.exit(main())
