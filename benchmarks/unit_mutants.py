#!/usr/bin/env python3
"""Which small changes of a module do its own tests let through?

    python benchmarks/unit_mutants.py [--modules NAME...] [--jobs J]

All mutants of the modules. A process that has imported the libraries branches off for every mutant
and runs the tests with it. Those of modules that are compiled do not fly, and run them as plain
Python, one to four seconds each; those of the others fly on emulated boards, with the compiled code
that set-up or a run has made. What survives may still be noticed by other tests and the campaign,
see mutants.py. The exit code is 1 when more than a twentieth survive.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import os
import sys
import time
from types import ModuleType
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

_LIBRARIES = (
    *('numpy', 'scipy.integrate', 'scipy.linalg', 'scipy.signal', 'scipy.optimize', 'control'),
    *('pytest', 'hypothesis.strategies', 'yaml', 'numba'),
)


TESTS: dict[str, tuple[str, ...]] = {
    'maglev_model.inverse': (
        'test/model/test_inverse.py',
        'test/model/test_inverse_amplitude.py',
        'test/model/test_attraction_shares.py',
        'test/model/test_single_motor_inverse.py',
    ),
    'maglev_model.contract.controller_watch': ('test/model/contract/test_controller_watch.py',),
    'maglev_controller.landing': ('test/controller/test_landing.py',),
    'maglev_controller.reference_reach': ('test/controller/test_reference_reach.py',),
    'maglev_hw_bridge.amplifiers': bridge_tests('amplifiers'),
    'maglev_hw_bridge.encoders': bridge_tests('encoders'),
    'maglev_hw_bridge.sensing.observer': bridge_tests('observer', 'guard'),
    'maglev_hw_bridge.sensing.leaps': bridge_tests('leaps'),
    'maglev_hw_bridge.sensing.knock': bridge_tests('knock_bounds'),
    'maglev_hw_bridge.sensing.gap_knock': bridge_tests('gap_knock_bounds'),
    'maglev_hw_bridge.sensing.standing_still': bridge_tests(
        'doubt', 'roll_call', 'standing_still', 'all_missed'
    ),
    'maglev_hw_bridge.sensing.guard': bridge_tests('watch', 'guard'),
    'maglev_hw_bridge.landing': bridge_tests('way_down', 'way_down_bounds', 'push_down'),
}
"""Modules that are compiled, and their own tests, which do not fly."""

FLYING: dict[str, tuple[str, ...]] = {
    'maglev_controller.supervision': (
        'test/controller/test_supervised_parts.py',
        'test/controller/test_supervision.py',
        'test/controller/test_platen_does_not_follow.py',
        'test/controller/test_unreachable_reference.py',
        'test/controller/test_foreign_law.py',
        'test/controller/test_foreign_law_in_flight.py',
    ),
    'maglev_hw_bridge.board': bridge_tests(
        'board', 'boards_that_fail', 'driver_calls', 'lines_and_offsets'
    ),
    'maglev_hw_bridge.drivers.quanser': bridge_tests(
        'driver_calls', 'lines_and_offsets', 'boards_that_fail', 'board'
    ),
    'maglev_hw_bridge.life_cycle': bridge_tests(
        'what_a_life_leaves', 'homing', 'life_cycle', 'memory'
    ),
    'maglev_hw_bridge.memory': bridge_tests('memory'),
    'maglev_hw_bridge.commissioning.proof': bridge_tests('proof_in_turn', 'proof'),
    'maglev_hw_bridge.stage': bridge_tests(
        'stage_rest', 'stage_samples', 'stage_faults', 'what_a_life_leaves'
    ),
}
"""Modules that are not, and theirs."""

EVERY = {**TESTS, **FLYING}

_PATIENCE = 120.0  # with the tests of a mutant [s]


class _Changed(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Imports a mutant for its module."""

    def __init__(self, mutant: Mutant) -> None:
        self._mutant, self._path = mutant, str(path_of(mutant.module, ROOT))

    def find_spec(
        self, name: str, path: object, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        if name != self._mutant.module:
            return None
        return importlib.util.spec_from_loader(name, self, origin=self._path)

    def exec_module(self, module: ModuleType) -> None:
        module.__file__ = self._path
        exec(compile(self._mutant.source, self._path, 'exec'), module.__dict__)


def _interpret() -> None:
    """Leave compiled functions as they are written, and let records have attributes there too."""
    import numpy as np

    from maglev_model.compiled import ahead
    from maglev_model.compiled.records import Record

    ahead.stand_in_by(lambda function, make: function)
    hold = Record._hold
    Record._hold = lambda self, block: hold(self, block.view(np.recarray))  # type: ignore


def _test(module: str, mutant: Mutant | None) -> None:
    """In a child: run the tests, and leave with their code."""
    os.setsid()
    silence = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(silence, stream)
    if mutant is not None:
        sys.meta_path.insert(0, _Changed(mutant))
    os.environ['PYTEST_DISABLE_PLUGIN_AUTOLOAD'] = '1'  # what tests need is named
    code = 1
    try:
        import pytest
        from hypothesis import Phase, settings

        settings.register_profile('mutants', phases=(Phase.explicit, Phase.generate))
        settings.load_profile('mutants')  # one example that fails is enough, however large
        if module in TESTS:
            _interpret()
        options = ('-q', '-x', '-W', 'ignore::RuntimeWarning', '-p', 'no:cacheprovider')
        code = int(pytest.main([*options, '-p', 'hypothesispytest', *EVERY[module]]))
    finally:
        os._exit(code)


class Child(NamedTuple):
    """The tests of a mutant, under way."""

    mutant: Mutant | None
    until: float


def _branch(module: str, mutant: Mutant | None, running: dict[int, Child]) -> None:
    pid = os.fork()
    if pid == 0:
        _test(module, mutant)
    running[pid] = Child(mutant, time.monotonic() + _PATIENCE)


def _next(running: dict[int, Child]) -> tuple[Child, bool]:
    """Wait for the next that ends, or lasts too long; whether its tests passed."""
    while True:
        pid, status = os.waitpid(-1, os.WNOHANG)
        if pid in running:
            kill(pid)
            return running.pop(pid), status == 0
        for late, child in running.items():
            if time.monotonic() > child.until:
                kill(late)
        time.sleep(0.01)


def judge(module: str, jobs: int) -> tuple[int, int]:
    """Mutants of a module that survived, and all. Raises SystemExit when its own tests fail."""
    running: dict[int, Child] = {}
    mutants = [mutant_of(module, number) for number in range(len(edits_of(module)[1]))]
    waiting = [mutant for mutant in mutants if difference(mutant)]
    number, survived = len(waiting), 0
    try:
        _branch(module, None, running)
        if not _next(running)[1]:
            tests = ' '.join(EVERY[module])
            sys.exit(f'unit_mutants: without any change these tests fail: {tests}')
        while waiting or running:
            while waiting and len(running) < jobs:
                _branch(module, waiting.pop(0), running)
            child, passed = _next(running)
            if passed and child.mutant is not None:
                survived += 1
                print(f'\nsurvived: {module}:{child.mutant.line}\n{difference(child.mutant)}')
            done = number - len(waiting) - len(running)
            print(f'\r{module} {done}/{number}', end='', file=sys.stderr, flush=True)
    finally:
        for pid in running:
            kill(pid)
    return survived, number


def main() -> int:
    """Entry point."""
    given = parser_for(__doc__, EVERY).parse_args()
    heed_signals()
    os.chdir(ROOT)
    for library in _LIBRARIES:
        with contextlib.suppress(ModuleNotFoundError):  # only speed depends on it
            importlib.import_module(library)
    survived = every = 0
    try:
        for module in given.modules:
            lived, number = judge(module, given.jobs)
            print(f'\n{module:40} {number:4} mutants, {lived:3} survived', flush=True)
            survived, every = survived + lived, every + number
    except KeyboardInterrupt:
        print('\nunit_mutants: interrupted', file=sys.stderr)
        return INTERRUPTED
    print(f'{survived} of {every} survived: {100 * survived / every:.1f} %')
    return int(survived > ALLOWED * every)


if __name__ == '__main__':
    sys.exit(main())
