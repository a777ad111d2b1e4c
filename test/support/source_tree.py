"""What the sources import: read from the code, without running it."""

from __future__ import annotations

import ast
import functools
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = tuple(sorted(path.parent.name for path in ROOT.glob('src/*/setup.py')))
"""The Python packages."""

PURE = tuple(
    f'maglev_{room}' for room in ('controller', 'model', 'monitor', 'plant', 'reference', 'study')
)
"""Those that work without ROS, their nodes apart."""


@functools.cache
def modules(package: str) -> dict[str, Path]:
    """The files of a package by the names of their modules."""
    base = ROOT / 'src' / package
    found = {}
    for path in sorted((base / package).rglob('*.py')):
        parts = path.relative_to(base).with_suffix('').parts
        found['.'.join(parts[:-1] if parts[-1] == '__init__' else parts)] = path
    return found


@functools.cache
def imported(path: Path) -> frozenset[str]:
    """Every name a file imports, also within functions: ``a.b`` and ``a.b.c`` of ``from a.b``."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'), str(path))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.module is not None, f'{path}:{node.lineno}: a relative import'
            found.add(node.module)
            found.update(f'{node.module}.{alias.name}' for alias in node.names)
    return frozenset(found)


def top_level(names: Iterable[str]) -> set[str]:
    """The packages that names lie in."""
    return {name.partition('.')[0] for name in names}
