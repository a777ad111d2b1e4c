"""The closed loop plainly in C, closed_loop.c: compiled here, on the records of the compiled loop.

The same types, so the same constants and states: what C carries on is what a
:class:`~maglev_controller.regulator.Regulator` and a
:class:`~maglev_plant.simulation.SimulatedStage` hold.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from maglev_controller.regulator import Regulator
from maglev_controller.step.arrays import MODEL, RECORDS
from maglev_model.machine import Machine
from maglev_plant.arrays import StageArrays
from maglev_plant.simulation import SimulatedStage
from maglev_study.references import References

SOURCE = Path(__file__).with_name('closed_loop.c')
COMPILE = ('cc', '-std=c11', '-O3', '-march=native', '-shared', '-fPIC')
_KINDS = {'f8': 'double', 'i8': 'int64_t', 'i1': 'int8_t', 'b1': '_Bool'}
_NAMES = {'axes': 'axis'}  # one of many


def _structs(name: str, dtype: np.dtype[np.void]) -> Iterator[str]:
    """A record and what it holds as C has them, the inner ones first."""
    lines = []
    for field in dtype.names or ():
        element, shape = dtype[field].base, dtype[field].shape
        inner = _NAMES.get(field, field)
        inner = inner if name in ('control', 'stage') else f'{name}_{inner}'
        if element.names:
            yield from _structs(inner, element)
            kind = f'struct {inner}'
        else:
            kind = _KINDS[element.str[1:]]
        lines.append(f'  {kind} {field}{"".join(f"[{size}]" for size in shape)};')
    yield f'struct {name} {{\n' + '\n'.join(lines) + '\n};'
    yield f'_Static_assert(sizeof(struct {name}) == {dtype.itemsize}, "{name}");'


def _header() -> str:
    machine = np.dtype([(name, 'f8') for name in Machine._fields])
    records = (
        ('machine', machine),
        ('stage', StageArrays.dtype),
        ('control', RECORDS),
        ('model', MODEL),
    )
    lines = [line for name, dtype in records for line in _structs(name, dtype)]
    return '\n'.join(['#include <stdint.h>', *lines, ''])


class LoopInC:
    """The compiled library; raises OSError without a C compiler, and where it refuses."""

    def __init__(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            library = Path(folder) / 'closed_loop.so'
            Path(folder, 'records.h').write_text(_header(), encoding='ascii')
            command = [*COMPILE, f'-I{folder}', '-o', str(library), str(SOURCE), '-lm']
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise OSError(done.stderr)
            self._function = ctypes.CDLL(str(library)).closed_loop

    def run(
        self, regulator: Regulator, stage: SimulatedStage, references: References
    ) -> tuple[np.ndarray, np.ndarray]:
        """States (n, 10) and currents (n, 8) of a flight; both arguments keep their states.

        Raises RuntimeError, naming the sample, where a limit is met.
        """
        n = len(references.position)
        state, current = np.empty((n, 10)), np.empty((n, 8))
        reading, own = np.empty((n, 6)), np.empty((n, 6))
        control = regulator.arrays
        arrays = [stage.arrays.block, *control, *(np.ascontiguousarray(one) for one in references)]
        arrays += [state, reading, own, current]
        pointers: list[ctypes.c_void_p | ctypes.c_int] = [
            ctypes.c_void_p(one.ctypes.data) for one in arrays
        ]
        pointers.insert(5, ctypes.c_int(control.xi.shape[1]))
        done = self._function(ctypes.c_int(n), *pointers)
        if done < n:
            raise RuntimeError(f'sample {done}: a limit is met')
        return state, current
