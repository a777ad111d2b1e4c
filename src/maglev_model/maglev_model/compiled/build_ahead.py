"""Compile ahead what a process called; needs Numba and a C compiler.

For :mod:`maglev_model.compiled.ahead`. After :func:`record`, import and call what nodes call; then
:func:`build` what was :func:`called`.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import warnings
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from maglev_model.compiled import ahead, numba


class Recorder(ahead.StandIn):
    """A function that notes what it was called with from Python."""

    def __init__(self, function: Callable[..., Any], make: Callable[[], Any]) -> None:
        super().__init__(function, make)
        self.called_with: set[tuple[Any, ...]] = set()
        self._known: set[Any] = set()
        _recorders.append(self)

    def __call__(self, *arguments: Any) -> Any:
        """Call it, compiled."""
        kind = _kind(arguments)
        if kind not in self._known:  # Numba's type of a record takes its time
            self._known.add(kind)
            self.called_with.add(tuple(numba().typeof(one) for one in arguments))
        return self.real(*arguments)


def _kind(argument: Any) -> Any:
    """What Numba's type of an argument depends on."""
    if isinstance(argument, tuple):
        return type(argument), tuple(_kind(one) for one in argument)
    if isinstance(argument, np.ndarray):
        flags = argument.flags
        layout = flags.c_contiguous, flags.f_contiguous, flags.aligned, flags.writeable
        return argument.dtype, argument.ndim, layout
    return type(argument)


Calls = Mapping[Recorder, frozenset[tuple[Any, ...]]]
"""The types of the arguments that functions were called with."""

_recorders: list[Recorder] = []


def record() -> None:
    """Note what compiled functions are called with; of those that are decorated afterwards."""
    ahead.stand_in_by(Recorder)


def called() -> Calls:
    """What functions were called with so far."""
    return {one: frozenset(one.called_with) for one in _recorders if one.called_with}


def build(name: str, folder: Path, calls: Calls) -> None:
    """Compile the functions of such calls into the extension module ``name`` in ``folder``.

    Raises ValueError where one was called with arguments of several types.
    """
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')  # that this part of Numba may be replaced one day
        from numba.pycc import CC
    library = CC(name)
    library.target_cpu = 'host'
    for function, kinds in calls.items():
        if len(kinds) > 1:
            raise ValueError(f"'{ahead.symbol(function)}' was called in several ways")
        (types,) = kinds
        result = function.real.overloads[types].signature.return_type
        library.export(ahead.symbol(function), result(*types))(_calling(function.real, len(types)))
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as unfinished:
        library.output_dir = unfinished
        library.compile()
        told = {ahead.symbol(one): digests(kinds) for one, kinds in calls.items()}
        (Path(unfinished) / f'{name}.json').write_text(json.dumps(told, indent=1), encoding='utf-8')
        for path in Path(unfinished).iterdir():
            path.replace(folder / path.name)


def digests(kinds: Iterable[tuple[Any, ...]]) -> list[str]:
    """Of types of arguments, which are long; equal where these are."""
    return sorted(hashlib.sha256(str(types).encode()).hexdigest()[:16] for types in kinds)


def _calling(function: Any, arguments: int) -> Any:
    """A plain function that passes so many arguments on, which keeps how the other is compiled."""
    names = ', '.join(f'argument_{number}' for number in range(arguments))
    return eval(f'lambda {names}: function({names})', {'function': function})
