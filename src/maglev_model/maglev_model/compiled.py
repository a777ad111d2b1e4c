"""The decorator of every function that runs at the sample rate."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar, cast

from maglev_model.sources import sources_digest


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


with _absent('coverage'):  # a tenth of a second, for what only a coverage run could want
    import numba

Function = TypeVar('Function', bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile a function with Numba and keep the machine code on disk; its type is left as it is.

    Arithmetic stays IEEE in the order written (no fast-math), so that runs repeat bit by bit; a
    division by zero gives infinity or NaN, as in NumPy, which costs no test of each divisor.
    """
    return cast(Function, numba.njit(cache=True, error_model='numpy', _nrt=True)(function))


def borrowing(function: Function) -> Function:
    """As :func:`compiled`, for a function that only borrows its arrays: a quarter faster in all.

    Numba does not count who holds them then. The function may neither make arrays, nor copy one
    into a slice of another, both of which Numba refuses, and must not return one it was given. It
    becomes part of what calls it: else each call would copy the constants of the machine.
    """
    decorated = numba.njit(cache=True, error_model='numpy', _nrt=False, forceinline=True)
    return cast(Function, decorated(function))


def _cache_by_sources() -> None:
    """Give each state of the sources a cache of its own, unless NUMBA_CACHE_DIR names one.

    Numba notices a change of a function's own file but not of the functions it calls in others, and
    would go on running the old ones.
    """
    if 'NUMBA_CACHE_DIR' in os.environ:
        return
    home = Path(os.environ.get('XDG_CACHE_HOME') or Path.home() / '.cache')
    numba.config.CACHE_DIR = str(home / 'maglev-stage' / sources_digest())


_cache_by_sources()
