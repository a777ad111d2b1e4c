"""The decorator of every function that runs at the sample rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar('Function', bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile a function with Numba and keep the machine code on disk; its type is left as it is.

    Arithmetic stays IEEE in the order written (no fast-math), so that runs repeat bit by bit.
    """
    return cast(Function, njit(cache=True)(function))
