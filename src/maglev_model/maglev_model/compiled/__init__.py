"""The decorator of every function that runs at the sample rate."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

from maglev_model.compiled import ahead
from maglev_model.compiled.sources import sources_digest


@contextlib.contextmanager
def _absent(name: str) -> Iterator[None]:
    """What imports a module meanwhile if it can is told that there is none, unless it is there."""
    if name in sys.modules:
        yield
        return
    sys.modules[name] = cast(Any, None)
    try:
        yield
    finally:
        del sys.modules[name]


Function = TypeVar('Function', bound=Callable[..., Any])


@functools.cache
def numba() -> Any:
    """Numba, imported when it is first needed: a node may do without, see :mod:`ahead`."""
    with _absent('coverage'):  # a tenth of a second, for what only a coverage run could want
        module = importlib.import_module('numba')
    _cache_by_sources(module)
    ahead.teach_numba()
    return module


def compiled(function: Function) -> Function:
    """Compile a function with Numba and keep the machine code on disk; its type is left as it is.

    Arithmetic stays IEEE in the order written (no fast-math), so that runs repeat bit by bit; a
    division by zero gives infinity or NaN, as in NumPy, which costs no test of each divisor.
    """
    return _compiled(function, _nrt=True)


def borrowing(function: Function) -> Function:
    """As :func:`compiled`, for a function that only borrows its arrays: a quarter faster in all.

    Numba does not count who holds them then. The function may neither make arrays, nor copy one
    into a slice of another, both of which Numba refuses, and must not return one it was given. It
    becomes part of what calls it: else each call would copy the constants of the machine.
    """
    return _compiled(function, _nrt=False, forceinline=True)


def _compiled(function: Function, **options: bool) -> Function:
    def make() -> Any:
        return numba().njit(cache=True, error_model='numpy', **options)(function)

    return cast(Function, ahead.stand_in(function, make))


def intrinsic(function: Callable[..., Any]) -> Any:
    """Numba's decorator of that name."""
    return ahead.stand_in(function, lambda: numba().extending.intrinsic(function))


def _cache_by_sources(module: Any) -> None:
    """Give each state of the sources a cache of its own, in NUMBA_CACHE_DIR where that is set.

    Numba notices a change of a function's own file but not of the functions it calls in others, and
    would go on running the old ones.
    """
    home = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
    place = os.environ.get('NUMBA_CACHE_DIR') or home / 'maglev-stage'
    module.config.CACHE_DIR = str(Path(place) / sources_digest())
