"""Modules that a parameter names: one of a package of ours, or anybody's by its dotted path."""

from __future__ import annotations

import functools
import importlib
import pkgutil
import traceback
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

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


def plugin_function(
    parameter: str, name: str, function: str, package: str = '', gives: type = object
) -> Callable[..., Any]:
    """A ``function`` of the module that :func:`find_plugin` finds.

    Of anybody's module, it raises nothing but :class:`ParameterError`: with what went wrong and
    where, or where the result is none of what it ``gives``.
    """
    called: Callable[..., Any] = getattr(
        find_plugin(parameter, name, (function,), package), function
    )
    if '.' not in name:
        return called

    @functools.wraps(called)
    def checked(*given: Any) -> Any:
        whose = f"parameter '{parameter}' is '{name}', whose '{function}'"
        try:
            found = called(*given)
        except ParameterError:
            raise
        except Exception as error:
            raise ParameterError(f'{whose} raised {describe_error(error)}') from error
        if not isinstance(found, gives):
            raise ParameterError(
                f'{whose} returned {type(found).__name__}: it must be {gives.__name__}'
            )
        return found

    return checked


def describe_error(error: BaseException) -> str:
    """An exception in a line, and where in what was called it comes from."""
    frames = traceback.extract_tb(error.__traceback__)[1:]
    where = (
        f' ({frames[-1].filename.rpartition("/")[2]}, line {frames[-1].lineno})' if frames else ''
    )
    text = str(error).partition('\n')[0]
    return f'{type(error).__name__}{": " if text else ""}{text}{where}'
