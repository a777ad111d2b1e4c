"""What Numba has compiled, or loaded, in this process."""

from __future__ import annotations

import gc
from collections.abc import Mapping

from numba.core.registry import CPUDispatcher


def compiled(since: Mapping[str, int] | None = None) -> dict[str, int]:
    """How many versions there are of each function; with ``since``, of those that are new only."""
    functions = [each for each in gc.get_objects() if isinstance(each, CPUDispatcher)]
    names = (f'{each.py_func.__module__}.{each.py_func.__qualname__}' for each in functions)
    versions = dict(zip(names, (len(each.overloads) for each in functions), strict=True))
    if since is None:
        return versions
    return {name: count for name, count in versions.items() if count != since.get(name, 0)}
