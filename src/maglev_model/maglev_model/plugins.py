"""Modules that a parameter names: one of a package of ours, or anybody's by its dotted path."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Sequence
from types import ModuleType

from maglev_model.parameters import ParameterError


def names_in(package: str) -> tuple[str, ...]:
    """The modules of a package, by name."""
    path = importlib.import_module(package).__path__
    return tuple(sorted(module.name for module in pkgutil.iter_modules(path)))


def find_plugin(
    parameter: str, name: str, functions: Sequence[str], package: str = ''
) -> ModuleType:
    """The module called ``name`` in ``package``, or at the dotted path ``name``.

    ``parameter`` is the one that names it. Raises :class:`ParameterError` with the names there are
    when it is none of them, when it cannot be imported, and when it lacks one of ``functions``.
    """
    given = f"parameter '{parameter}' is '{name}'"
    if '.' not in name:
        known = names_in(package) if package else ()
        if name not in known:
            choices = f'one of {", ".join(known)}, or ' if known else ''
            raise ParameterError(f'{given}, it must be {choices}the dotted path of a module')
    try:
        module = importlib.import_module(name if '.' in name else f'{package}.{name}')
    except Exception as error:
        raise ParameterError(
            f'{given}, which cannot be imported: {type(error).__name__}: {error}'
        ) from error
    for function in functions:
        if not callable(getattr(module, function, None)):
            raise ParameterError(f"{given}, a module without the function '{function}'")
    return module
