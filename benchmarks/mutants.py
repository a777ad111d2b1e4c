#!/usr/bin/env python3
"""Which small changes of the code do the tests let through?

    python benchmarks/mutants.py [--modules NAME...] [--mutants N] [--seed S] [--jobs J]

Copies the tree, changes one thing at a time in the copy (a comparison, a sign, an operator, a
constant by a fifth, a truth value, two arguments swapped, a statement dropped), and runs the tests
that look at the module. Compiled code is kept except where it stands on what was changed. A mutant
that no test notices is printed as a difference; the exit code is 1 when more than a twentieth of
them survive.
"""

from __future__ import annotations

import argparse
import ast
import concurrent.futures
import difflib
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = 0.05

_CAMPAIGN = ('test/study/faults/test_campaign.py', 'test/study/faults/test_judge.py')
_BRIDGE = (
    *(f'test/hw_bridge/test_{name}.py' for name in ('driver_calls', 'encoders', 'amplifiers')),
    *(f'test/hw_bridge/test_{name}.py' for name in ('landing', 'faults', 'controllers')),
    *(f'test/hw_bridge/test_{name}.py' for name in ('guard', 'knock', 'unseen', 'resting')),
    *(f'test/hw_bridge/test_{name}.py' for name in ('life_cycle', 'sensing', 'commission')),
    *_CAMPAIGN,
)
LOOKED_AT_BY: dict[str, tuple[str, ...]] = {
    'maglev_hw_bridge.guard': _BRIDGE,
    'maglev_hw_bridge.leaps': _BRIDGE,
    'maglev_hw_bridge.standing_still': _BRIDGE,
    'maglev_hw_bridge.observer': _BRIDGE,
    'maglev_hw_bridge.knock': _BRIDGE,
    'maglev_hw_bridge.landing': _BRIDGE,
    'maglev_hw_bridge.stage': _BRIDGE,
    'maglev_hw_bridge.life_cycle': _BRIDGE,
    'maglev_hw_bridge.amplifiers': _BRIDGE,
    'maglev_hw_bridge.encoders': _BRIDGE,
    'maglev_hw_bridge.board': _BRIDGE,
    'maglev_hw_bridge.drivers.quanser': _BRIDGE,
    'maglev_controller.supervision': ('test/controller', *_CAMPAIGN),
    'maglev_controller.landing': ('test/controller', *_CAMPAIGN),
    'maglev_model.controller_watch': ('test/model/test_controller_watch.py', 'test/node'),
    'maglev_model.inverse': ('test/model', 'test/controller', 'test/reference/test_currents.py'),
}
"""Modules, and the tests that look at them, the fastest first."""

_OPPOSITES: dict[type[ast.AST], tuple[type[ast.AST], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}

Edit = Callable[[], None]


class Mutant(NamedTuple):
    """One changed source."""

    module: str
    line: int
    source: str


class Outcome(NamedTuple):
    """What became of a mutant."""

    mutant: Mutant
    survived: bool
    seconds: float


def _operators(node: ast.AST) -> Iterator[Edit]:
    """Other operators."""

    def put(index: int, other: type[ast.AST]) -> None:
        if isinstance(node, ast.Compare):
            node.ops[index] = other()  # type: ignore[call-overload]
        else:
            node.op = other()  # type: ignore[attr-defined]

    found: list[ast.AST] = []
    if isinstance(node, ast.Compare):
        found = list(node.ops)
    elif isinstance(node, (ast.BinOp, ast.BoolOp, ast.AugAssign)):
        found = [node.op]
    for index, operator in enumerate(found):
        for other in _OPPOSITES.get(type(operator), ()):
            yield lambda index=index, other=other: put(index, other)  # type: ignore[misc]


def _values(node: ast.AST) -> Iterator[Edit]:
    """Other constants, no sign, no ``not``, two arguments swapped."""
    if isinstance(node, ast.Constant):
        value = node.value
        if isinstance(value, bool):
            yield lambda: setattr(node, 'value', not value)
        elif isinstance(value, int):
            yield lambda: setattr(node, 'value', value + 1)
        elif isinstance(value, float):
            yield lambda: setattr(node, 'value', 1.2 * value if value else 0.1)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        changed = ast.UAdd() if isinstance(node.op, ast.USub) else None
        if changed:
            yield lambda: setattr(node, 'op', changed)
        else:
            doubled = ast.UnaryOp(ast.Not(), node.operand)
            yield lambda: setattr(node, 'operand', doubled)
    elif isinstance(node, ast.Call) and _order_matters(node):
        swapped = [node.args[1], node.args[0], *node.args[2:]]
        yield lambda: setattr(node, 'args', swapped)


def _order_matters(call: ast.Call) -> bool:
    either = isinstance(call.func, ast.Name) and call.func.id in ('min', 'max')
    return len(call.args) >= 2 and not either and ast.dump(call.args[0]) != ast.dump(call.args[1])


def _dropped(node: ast.AST) -> Iterator[Edit]:
    """Statements without which the function still runs."""
    for name in ('body', 'orelse', 'finalbody'):
        block = getattr(node, name, None)
        if not isinstance(block, list) or isinstance(node, (ast.Module, ast.ClassDef)):
            continue
        for index, statement in enumerate(block):
            leaves = isinstance(statement, (ast.AugAssign, ast.Raise, ast.If, ast.Expr)) or (
                isinstance(statement, ast.Assign)
                and not any(
                    isinstance(part, ast.Name)
                    for part in ast.walk(statement.targets[0])
                    if isinstance(getattr(part, 'ctx', None), ast.Store)
                )
            )
            documentation = isinstance(statement, ast.Expr) and isinstance(
                statement.value, (ast.Constant, ast.Yield)
            )
            if leaves and not documentation:
                yield lambda block=block, index=index: block.__setitem__(  # type: ignore[misc]
                    index, ast.Pass()
                )


def _code(tree: ast.AST) -> Iterator[ast.AST]:
    """Nodes of what runs: bodies of functions, without annotations, defaults and messages."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node
            for statement in node.body:
                yield statement
                yield from _inside(statement)
        elif isinstance(node, ast.ClassDef):
            yield from _code(node)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)) and isinstance(node.value, ast.Constant):
            yield node.value


def _inside(node: ast.AST) -> Iterator[ast.AST]:
    for name, field in ast.iter_fields(node):
        if name in ('annotation', 'returns') or isinstance(node, ast.JoinedStr):
            continue
        for child in field if isinstance(field, list) else [field]:
            if isinstance(child, ast.AST):
                yield child
                yield from _inside(child)


def mutants(module: str) -> list[Mutant]:
    """Every mutant of a module."""
    original = path_of(module, ROOT).read_text()

    def edits() -> tuple[ast.Module, list[tuple[int, Edit]]]:
        tree = ast.parse(original)
        return tree, [
            (getattr(node, 'lineno', 0), edit)
            for node in _code(tree)
            for find in (_operators, _values, _dropped)
            for edit in find(node)
        ]

    found = []
    for number in range(len(edits()[1])):
        tree, changes = edits()
        line, edit = changes[number]
        edit()
        found.append(Mutant(module, line, ast.unparse(ast.fix_missing_locations(tree))))
    return found


def path_of(module: str, root: Path) -> Path:
    """Where a module's source lies in a tree."""
    return root.joinpath('src', module.split('.')[0], *module.split('.')).with_suffix('.py')


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
            if name not in reached
            and wanted.search('\n'.join(re.findall(r'^.*import.*$', text, re.M)))
        }
        reached |= front
    return {name.rsplit('.', 1)[-1] for name in reached}


class Copy:
    """A copy of the tree, with compiled code of its own."""

    def __init__(self, where: Path) -> None:
        self.where = where
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
        packages = ':'.join(str(path) for path in sorted((where / 'src').iterdir()))
        self._environment = os.environ | {
            'PYTHONPATH': f'{packages}:{os.environ.get("PYTHONPATH", "")}',
            'NUMBA_CACHE_DIR': str(self._cache),
            'PYTEST_DISABLE_PLUGIN_AUTOLOAD': '1',
            'PYTHONDONTWRITEBYTECODE': '1',
            'HYPOTHESIS_STORAGE_DIRECTORY': str(where / 'hypothesis'),
        }

    def test(self, tests: tuple[str, ...], limit: float | None = None) -> bool:
        """Whether all tests pass, in time."""
        try:
            done = subprocess.run(
                [
                    sys.executable,
                    '-m',
                    'pytest',
                    '-q',
                    '-x',
                    '-p',
                    'hypothesispytest',
                    '-p',
                    'no:cacheprovider',
                    '-m',
                    'not alone',
                    *tests,
                ],
                cwd=self.where,
                env=self._environment,
                timeout=limit,
                check=False,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired:
            return False
        return done.returncode == 0

    def warm_up(self, tests: tuple[str, ...]) -> float:
        """Compile what the unchanged tests need; returns how long the tests take after that [s].

        Raises SystemExit when they fail.
        """
        for _ in range(2):
            begin = time.monotonic()
            if not self.test(tests):
                sys.exit(f'mutants: without any change these tests fail: {" ".join(tests)}')
        shutil.copytree(self._cache, self._warm, dirs_exist_ok=True)
        return time.monotonic() - begin

    def judge(self, mutant: Mutant, tests: tuple[str, ...], limit: float) -> Outcome:
        """Run the tests on a mutant."""
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
            survived = self.test(tests, limit)
        finally:
            path.write_text(original)
            shutil.copystat(path_of(mutant.module, ROOT), path)
        return Outcome(mutant, survived, time.monotonic() - begin)


def difference(mutant: Mutant) -> str:
    """The changed lines."""
    plain = ast.unparse(ast.parse(path_of(mutant.module, ROOT).read_text()))
    lines = difflib.unified_diff(plain.splitlines(), mutant.source.splitlines(), lineterm='', n=0)
    return '\n'.join(line for line in list(lines)[2:] if not line.startswith('@@'))


def run(modules: list[str], number: int, seed: int, jobs: int) -> list[Outcome]:
    """Judge ``number`` mutants, drawn evenly from all of the modules'."""
    every = [mutant for module in modules for mutant in mutants(module)]
    drawn = random.Random(seed).sample(every, min(number, len(every)))
    print(f'{len(drawn)} of {len(every)} mutants of {len(modules)} modules', flush=True)
    suites = {LOOKED_AT_BY[module] for module in modules}
    with tempfile.TemporaryDirectory(prefix='maglev-mutants') as folder:
        copies = [Copy(Path(folder, str(job))) for job in range(jobs)]
        took = {tests: max(copy.warm_up(tests) for copy in copies) for tests in suites}
        outcomes: list[Outcome] = []

        def work(copy: Copy, share: list[Mutant]) -> None:
            for mutant in share:
                tests = LOOKED_AT_BY[mutant.module]
                outcome = copy.judge(mutant, tests, 120.0 + 5.0 * took[tests])
                outcomes.append(outcome)
                if outcome.survived:
                    print(f'\nsurvived: {mutant.module}:{mutant.line}\n{difference(mutant)}')
                print(f'\r{len(outcomes)}/{len(drawn)}', end='', file=sys.stderr, flush=True)

        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            list(pool.map(work, copies, [drawn[job::jobs] for job in range(jobs)]))
    return outcomes


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else '')
    parser.add_argument(
        '--modules',
        nargs='+',
        choices=sorted(LOOKED_AT_BY),
        metavar='NAME',
        default=sorted(LOOKED_AT_BY),
        help='default: all that are known',
    )
    parser.add_argument('--mutants', type=int, default=200, metavar='N')
    parser.add_argument('--seed', type=int, default=1, metavar='S')
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, metavar='J')
    given = parser.parse_args()
    outcomes = run(given.modules, given.mutants, given.seed, given.jobs)
    print()
    for module in given.modules:
        its = [outcome for outcome in outcomes if outcome.mutant.module == module]
        lived = sum(outcome.survived for outcome in its)
        print(f'{module:40} {len(its):4} mutants, {lived:3} survived')
    lived = sum(outcome.survived for outcome in outcomes)
    print(f'{lived} of {len(outcomes)} survived: {100 * lived / max(len(outcomes), 1):.1f} %')
    return int(lived > ALLOWED * len(outcomes))


if __name__ == '__main__':
    sys.exit(main())
