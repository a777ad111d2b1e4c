"""Small changes of a module, each by itself: a comparison, a sign, a constant by a fifth."""

from __future__ import annotations

import argparse
import ast
import contextlib
import difflib
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = 0.05
"""Share of mutants that may survive."""

INTERRUPTED = 130

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


def bridge_tests(*names: str) -> tuple[str, ...]:
    """Files of the bridge's tests, in whatever folder they lie."""
    folder = ROOT / 'test' / 'hw_bridge'
    return tuple(
        str(path.relative_to(ROOT)) for name in names for path in folder.rglob(f'test_{name}.py')
    )


class Mutant(NamedTuple):
    """One changed source."""

    module: str
    line: int
    source: str


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
    name = ast.unparse(call.func)
    either = name.rsplit('.', 1)[-1] in ('min', 'max', 'minimum', 'maximum', 'hypot')
    either |= name == 'np.clip'  # a value and its lower bound
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
    """Nodes of what runs, without annotations, defaults and messages: constants and functions."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node
            for statement in node.body:
                yield statement
                yield from _inside(statement)
        elif isinstance(node, ast.ClassDef):
            yield from _code(node)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None:
            yield node.value
            yield from _inside(node.value)


def _inside(node: ast.AST) -> Iterator[ast.AST]:
    for name, field in ast.iter_fields(node):
        if name in ('annotation', 'returns') or isinstance(node, ast.JoinedStr):
            continue
        if isinstance(node, ast.Call) and ast.unparse(node.func) == 'np.empty':
            continue  # more room than is needed changes nothing
        for child in field if isinstance(field, list) else [field]:
            if isinstance(child, ast.AST):
                yield child
                yield from _inside(child)


def edits_of(module: str) -> tuple[ast.Module, list[tuple[int, Edit]]]:
    """A module's tree, and all that can be changed in it, by line."""
    tree = ast.parse(path_of(module, ROOT).read_text())
    return tree, [
        (getattr(node, 'lineno', 0), edit)
        for node in _code(tree)
        for find in (_operators, _values, _dropped)
        for edit in find(node)
    ]


def mutant_of(module: str, number: int) -> Mutant:
    """The mutant with that number of a module."""
    tree, edits = edits_of(module)
    line, edit = edits[number]
    edit()
    return Mutant(module, line, ast.unparse(ast.fix_missing_locations(tree)))


def path_of(module: str, root: Path) -> Path:
    """Where a module's source lies in a tree."""
    return root.joinpath('src', module.split('.')[0], *module.split('.')).with_suffix('.py')


def difference(mutant: Mutant) -> str:
    """The changed lines."""
    plain = ast.unparse(ast.parse(path_of(mutant.module, ROOT).read_text()))
    lines = difflib.unified_diff(plain.splitlines(), mutant.source.splitlines(), lineterm='', n=0)
    return '\n'.join(line for line in list(lines)[2:] if not line.startswith('@@'))


def parser_for(documentation: str | None, modules: Iterable[str]) -> argparse.ArgumentParser:
    """A parser for what says which modules, and how many at once."""
    parser = argparse.ArgumentParser(description=(documentation or '').partition('\n')[0])
    known = sorted(modules)
    parser.add_argument(
        '--modules',
        nargs='+',
        choices=known,
        metavar='NAME',
        default=known,
        help='default: all that are known',
    )
    parser.add_argument('--jobs', type=int, default=os.cpu_count() or 1, metavar='J')
    return parser


def heed_signals() -> None:
    """The first INT, TERM or HUP is a KeyboardInterrupt: what ends by it is not interrupted."""

    def interrupt(*_: object) -> None:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)
        raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    for number in numbers:
        signal.signal(number, interrupt)


def kill(group: int) -> None:
    """End a process that leads a group, with those that it branched off."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
