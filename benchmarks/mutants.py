"""Which small defects tests and campaign find: mutants of what keeps the platen from the stop.

    python benchmarks/mutants.py [--most N] [--seed S] [--campaign N] [MODULE...]

Changes one thing at a time in a copy of the sources (a comparison, a sign, a constant by 20 %, a
condition turned round, a statement dropped), runs the tests of that module's room and then a short
campaign, and lists the mutants that nothing noticed. Compiled code is made anew for each: about two
minutes of one core. Exits with 1 when fewer than 95 % were found.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
MODULES = {
    'maglev_hw_bridge/guard.py': ('hw_bridge',),
    'maglev_hw_bridge/landing.py': ('hw_bridge',),
    'maglev_hw_bridge/stage.py': ('hw_bridge', 'model/test_stage_contract.py'),
    'maglev_hw_bridge/drivers/quanser.py': ('hw_bridge',),
    'maglev_controller/supervision.py': ('controller',),
    'maglev_model/inverse.py': ('model', 'hw_bridge/test_landing.py'),
}
"""Modules, and the tests of their rooms; any other module of src/ may be named too."""

WANTED = 0.95
_PATIENCE = 900.0  # with the tests of one mutant, and with its campaign [s]

_OTHER: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.GtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


class Mutant(NamedTuple):
    """One change of a module."""

    module: str
    line: int
    what: str
    source: str


def mutants(module: str, source: str) -> Iterator[Mutant]:
    """Every mutant of a source."""
    tree = ast.parse(source)
    for number, node in enumerate(ast.walk(tree)):
        for change in _changes(node):
            mutated = copy.deepcopy(tree)
            twin = next(twin for n, twin in enumerate(ast.walk(mutated)) if n == number)
            what = change(twin)
            text = ast.unparse(ast.fix_missing_locations(mutated))
            yield Mutant(module, getattr(node, 'lineno', 0), what, text)


def _changes(node: ast.AST) -> Iterator[Callable[..., str]]:
    if isinstance(node, ast.Compare) and type(node.ops[0]) in _OTHER:
        yield _turn_comparison
    if isinstance(node, (ast.BinOp, ast.AugAssign, ast.BoolOp)) and type(node.op) in _OTHER:
        yield _turn_operator
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        yield _scale
    if isinstance(node, ast.If):
        yield _turn_condition
    if isinstance(node, ast.FunctionDef):
        for index, statement in enumerate(node.body):
            if isinstance(statement, (ast.Assign, ast.AugAssign, ast.If)) or (
                isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)
            ):
                yield _dropper(index)


def _turn_comparison(node: ast.Compare) -> str:
    before = ast.unparse(node)
    node.ops[0] = _OTHER[type(node.ops[0])]()  # type: ignore[assignment]
    return f'{before} -> {ast.unparse(node)}'


def _turn_operator(node: ast.BinOp | ast.AugAssign | ast.BoolOp) -> str:
    before = ast.unparse(node)
    node.op = _OTHER[type(node.op)]()  # type: ignore[assignment]
    return f'{before} -> {ast.unparse(node)}'


def _scale(node: ast.Constant) -> str:
    before, number = node.value, node.value
    assert isinstance(number, (int, float))
    node.value = number + 1 if isinstance(number, int) else 1.2 * number or 0.01
    return f'{before} -> {node.value}'


def _turn_condition(node: ast.If) -> str:
    before = ast.unparse(node.test)
    node.test = ast.UnaryOp(ast.Not(), node.test)
    return f'if {before} -> if not'


def _dropper(index: int) -> Callable[[ast.FunctionDef], str]:
    def drop(node: ast.FunctionDef) -> str:
        before = ast.unparse(node.body[index]).splitlines()[0]
        node.body[index] = ast.Pass()
        return f'dropped: {before}'

    return drop


def found_by(mutant: Mutant, copy_of_source: Path, campaign: int) -> str:
    """What notices a mutant: tests, campaign, or '' when nothing does."""
    path = copy_of_source / mutant.module.split('/')[0] / mutant.module
    before = path.read_text(encoding='utf-8')
    path.write_text(mutant.source, encoding='utf-8')
    try:
        with tempfile.TemporaryDirectory() as cache:
            folders = [str(folder) for folder in copy_of_source.iterdir() if folder.is_dir()]
            search = os.pathsep.join([*folders, os.environ.get('PYTHONPATH', '')])
            environment = {**os.environ, 'PYTHONPATH': search, 'NUMBA_CACHE_DIR': cache}
            tests = [str(ROOT / 'test' / name) for name in MODULES.get(mutant.module, ('.',))]
            if _fails([sys.executable, '-m', 'pytest', '-x', '-q', *tests], environment):
                return 'tests'
            fly = ['-m', 'maglev_study.faults.main', '--runs', str(campaign), '--out', cache]
            return 'campaign' if _fails([sys.executable, *fly], environment) else ''
    finally:
        path.write_text(before, encoding='utf-8')


def _fails(command: list[str], environment: dict[str, str]) -> bool:
    try:
        done = subprocess.run(
            command, env=environment, cwd=ROOT, capture_output=True, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def main() -> int:
    """Try a sample of mutants and list those that nothing noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])  # type: ignore[union-attr]
    parser.add_argument('modules', nargs='*', default=list(MODULES), metavar='MODULE')
    parser.add_argument('--most', type=int, default=100, help='how many, drawn at random')
    parser.add_argument('--seed', type=int, default=0, help='of the draw')
    parser.add_argument('--campaign', type=int, default=800, help='runs of the campaign')
    options = parser.parse_args()
    every = [
        mutant
        for module in options.modules
        for mutant in mutants(
            module, (ROOT / 'src' / module.split('/')[0] / module).read_text(encoding='utf-8')
        )
    ]
    chosen = random.Random(options.seed).sample(every, min(options.most, len(every)))
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        sources = Path(folder) / 'src'
        ignored = shutil.ignore_patterns('test', '__pycache__')
        shutil.copytree(ROOT / 'src', sources, ignore=ignored)
        for number, mutant in enumerate(chosen, 1):
            found = found_by(mutant, sources, options.campaign)
            missed += not found
            where = f'{mutant.module}:{mutant.line}'
            print(f'{number}/{len(chosen)} {found or "MISSED":8} {where} {mutant.what}', flush=True)
    share = 1.0 - missed / len(chosen)
    print(f'{len(every)} mutants there are, {len(chosen)} tried, {100 * share:.0f} % found')
    return int(share < WANTED)


if __name__ == '__main__':
    sys.exit(main())
