"""Compiled functions that a node takes from a file, so that it does without Numba.

Numba takes 0.4 s and 66 MB of each process that imports it. What nodes call is therefore compiled
ahead by set-up, see :mod:`maglev_model.compiled.build_ahead`, into extension modules beside Numba's
cache. A function that is not among them is compiled, and Numba imported, when it is first called.

The functions of such a file take their arguments for what they were when it was built, unchecked:
only a node, whose arrays are its own, may use them.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.machinery
import os
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from types import BuiltinFunctionType
from typing import Any

import numpy as np

from maglev_model.compiled.sources import sources_digest

SUFFIX = importlib.machinery.EXTENSION_SUFFIXES[0]

_found: dict[str, Any] = {}
"""The functions compiled ahead that are in use, by :func:`symbol`."""

_twins: dict[Any, StandIn] = {}
"""What stands for these where Numba compiles a function that calls them."""

_make_stand_in: Callable[[Callable[..., Any], Callable[[], Any]], Any] | None = None
"""What decorated functions become; None: what Numba makes of them at once."""


class StandIn:
    """A function that is compiled when it is first called."""

    def __init__(self, function: Callable[..., Any], make: Callable[[], Any]) -> None:
        functools.update_wrapper(self, function)
        self._make = make

    @functools.cached_property
    def real(self) -> Any:
        """What Numba makes of it."""
        return self._make()

    def __call__(self, *arguments: Any) -> Any:
        """Call it, compiled."""
        return self.real(*arguments)


def symbol(function: Callable[..., Any]) -> str:
    """Its name in a file of functions compiled ahead."""
    return f'{function.__module__}.{function.__qualname__}'.replace('.', '_')


def folder() -> Path | None:
    """Where such files lie: in ``NUMBA_CACHE_DIR``; None where that is not set.

    In a folder for these sources, this processor, interpreter and NumPy.
    """
    cache = os.environ.get('NUMBA_CACHE_DIR')
    if not cache:
        return None
    parts = (sources_digest(), _processor(), str(sys.implementation.cache_tag), np.__version__)
    return Path(cache) / f'ahead-{hashlib.sha256(chr(10).join(parts).encode()).hexdigest()[:16]}'


def _processor() -> str:
    try:
        lines = Path('/proc/cpuinfo').read_text(encoding='utf-8', errors='replace').splitlines()
    except OSError:
        return platform.processor()
    return '\n'.join(sorted({one for one in lines if one.startswith(('model name', 'flags'))}))


def use() -> bool:
    """Use what was compiled ahead in this process; whether there is any.

    Of functions that are decorated afterwards.
    """
    place = folder()
    for path in sorted(place.glob(f'*{SUFFIX}')) if place else ():
        with contextlib.suppress(ImportError):  # only speed depends on it
            _found.update(_functions(path))
    if _found:
        stand_in_by(_compiled_ahead)
    return bool(_found)


def _functions(path: Path) -> dict[str, Any]:
    name = path.name.removesuffix(SUFFIX)
    loader = importlib.machinery.ExtensionFileLoader(name, str(path))
    module = loader.create_module(importlib.machinery.ModuleSpec(name, loader, origin=str(path)))
    loader.exec_module(module)
    functions = vars(module).items()
    return {name: one for name, one in functions if isinstance(one, BuiltinFunctionType)}


def _compiled_ahead(function: Callable[..., Any], make: Callable[[], Any]) -> Any:
    instead = StandIn(function, make)
    ahead = _found.get(symbol(function))
    if ahead is None:
        return instead
    _twins[ahead] = instead
    return ahead


def stand_in_by(make: Callable[[Callable[..., Any], Callable[[], Any]], Any]) -> None:
    """Have ``make(function, compile)`` say what functions decorated afterwards become."""
    global _make_stand_in
    _make_stand_in = make


def stand_in(function: Callable[..., Any], make: Callable[[], Any]) -> Any:
    """What a decorated function becomes; ``make`` compiles it."""
    return make() if _make_stand_in is None else _make_stand_in(function, make)


def teach_numba() -> None:
    """Have Numba take what stands for compiled functions for these where others call it."""
    from numba.core.registry import cpu_target
    from numba.extending import typeof_impl

    def typed(instead: StandIn) -> Any:
        real = instead.real
        cpu_target.typing_context.refresh()  # an intrinsic may be made only now
        cpu_target.target_context.refresh()
        return cpu_target.typing_context.resolve_value_type(real)

    typeof_impl.register(StandIn)(lambda instead, _: typed(instead))
    typeof_impl.register(BuiltinFunctionType)(
        lambda one, _: typed(_twins[one]) if one in _twins else None
    )
