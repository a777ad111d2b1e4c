"""The decorator of every function that runs at the sample rate."""

from __future__ import annotations

import hashlib
import importlib.util
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

Function = TypeVar('Function', bound=Callable[..., Any])

_COMPILED_PACKAGES = tuple(
    f'maglev_{room}' for room in ('model', 'plant', 'controller', 'hw_bridge', 'study')
)


def compiled(function: Function) -> Function:
    """Compile a function with Numba and keep the machine code on disk; its type is left as it is.

    Arithmetic stays IEEE in the order written (no fast-math), so that runs repeat bit by bit.
    """
    return cast(Function, numba.njit(cache=True)(function))


def _cache_by_sources() -> None:
    """Give each state of the sources a cache of its own, unless NUMBA_CACHE_DIR names one.

    Numba notices a change of a function's own file but not of the functions it calls in others, and
    would go on running the old ones.
    """
    if 'NUMBA_CACHE_DIR' in os.environ:
        return
    digest = hashlib.sha256()
    for package in _COMPILED_PACKAGES:
        spec = importlib.util.find_spec(package)
        if spec is not None and spec.origin is not None:
            for path in sorted(Path(spec.origin).parent.rglob('*.py')):
                digest.update(path.read_bytes())
    home = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
    numba.config.CACHE_DIR = str(home / 'maglev-stage' / digest.hexdigest()[:16])


_cache_by_sources()
