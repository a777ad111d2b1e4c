"""Models of friction, motor and sensor from outside the package, one small function each.

A parameter names a module by its dotted path; its function is compiled and called by address, so
the stage's own code is compiled once, whatever model it meets. The functions, plain Python that
Numba compiles:

- ``force(velocity, level, step, memory)``: friction [N, N m] that resists in the next ``step`` [s],
  of a guide that slides at ``velocity`` with the level F(v) there; not asked for where the level
  is 0. ``memory``, four floats that begin with 0, is the guide's own.
- ``forces(gap, i_d, i_q, out)``: F_V and F_H of a motor [N] into ``out`` (2,), as (1), (2) have
  them: F_V positive where it widens the gap.
- ``reading(length, channel, sample, memory)``: what encoder ``channel`` (0..5) reads of a length
  [m], in place of the counts; ``memory`` as above.

Each is tried once, at rest at 25 mm. What raises in flight, as an index out of bounds does, gives
NaN, which no flight goes on with.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from maglev_model.compiled import intrinsic, numba
from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import find_plugin

_MEMORY = 4
_kept: list[Any] = []
"""Compiled models, which must live as long as their addresses are called."""


def _caller(result: str, *names: str) -> Any:
    """An intrinsic that calls what lies at an address; a ``uintp`` argument is a pointer."""
    types, ir = numba().types, numba().core.cgutils.ir
    back = ir.VoidType() if result == 'void' else ir.DoubleType()
    arguments = [getattr(types, name) for name in names]

    def build(typing_context: Any, address: Any, *given: Any) -> Any:
        signature = getattr(types, result)(types.int64, *arguments)

        def generate(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            where, *rest = values
            native = [
                builder.inttoptr(value, ir.DoubleType().as_pointer())
                if kind == types.uintp
                else value
                for kind, value in zip(arguments, rest, strict=True)
            ]
            function = ir.FunctionType(back, [value.type for value in native])
            called = builder.call(builder.inttoptr(where, function.as_pointer()), native)
            return context.get_dummy_value() if result == 'void' else called

        return signature, generate

    return build


@intrinsic
def call_friction(context, address, velocity, level, step, memory):  # type: ignore[no-untyped-def]
    """``force(velocity, level, step, memory)`` at ``address``."""
    build = _caller('float64', 'float64', 'float64', 'float64', 'uintp')
    return build(context, address, velocity, level, step, memory)


@intrinsic
def call_motor(context, address, gap, i_d, i_q, out):  # type: ignore[no-untyped-def]
    """``forces(gap, i_d, i_q, out)`` at ``address``."""
    build = _caller('void', 'float64', 'float64', 'float64', 'uintp')
    return build(context, address, gap, i_d, i_q, out)


@intrinsic
def call_sensor(context, address, length, channel, sample, memory):  # type: ignore[no-untyped-def]
    """``reading(length, channel, sample, memory)`` at ``address``."""
    build = _caller('float64', 'float64', 'int64', 'int64', 'uintp')
    return build(context, address, length, channel, sample, memory)


@functools.cache
def friction_address(name: str) -> int:
    """Address of the ``force`` of a module; raises ParameterError."""

    def made(force: Any) -> Any:
        carray = numba().carray

        @numba().cfunc('float64(float64, float64, float64, CPointer(float64))')
        def call(velocity, level, step, memory):  # type: ignore[no-untyped-def]
            try:
                return force(velocity, level, step, carray(memory, _MEMORY))
            except Exception:
                return math.nan

        return call

    def tried(force: Any) -> Any:
        return force(0.0, 1.0, 1e-3, np.zeros(_MEMORY))

    return _address('effects.friction.model', name, 'force', made, tried)


@functools.cache
def motor_address(name: str) -> int:
    """Address of the ``forces`` of a module; raises ParameterError."""

    def made(forces: Any) -> Any:
        carray = numba().carray

        @numba().cfunc('void(float64, float64, float64, CPointer(float64))')
        def call(gap, i_d, i_q, out):  # type: ignore[no-untyped-def]
            try:
                forces(gap, i_d, i_q, carray(out, 2))
            except Exception:
                out[0] = math.nan

        return call

    def tried(forces: Any) -> Any:
        out = np.full(2, np.nan)
        forces(0.025, 0.0, 0.0, out)
        return out

    return _address('effects.motor.model', name, 'forces', made, tried)


@functools.cache
def sensor_address(name: str) -> int:
    """Address of the ``reading`` of a module; raises ParameterError."""

    def made(reading: Any) -> Any:
        carray = numba().carray

        @numba().cfunc('float64(float64, int64, int64, CPointer(float64))')
        def call(length, channel, sample, memory):  # type: ignore[no-untyped-def]
            try:
                return reading(length, channel, sample, carray(memory, _MEMORY))
            except Exception:
                return math.nan

        return call

    def tried(reading: Any) -> Any:
        return reading(0.025, 0, 0, np.zeros(_MEMORY))

    return _address('effects.sensor.model', name, 'reading', made, tried)


def _address(
    parameter: str,
    name: str,
    function: str,
    make: Callable[[Any], Any],
    tried: Callable[[Any], Any],
) -> int:
    """Of the compiled function, once it is ``tried`` and gives what is finite."""
    module, where = find_plugin(parameter, name, (function,)), f"parameter '{parameter}' is"
    model = numba().njit(getattr(module, function), boundscheck=True)
    try:
        compiled = make(model)
    except numba().core.errors.NumbaError as error:
        told = (line for line in str(error).splitlines() if not line.startswith('Failed in'))
        reason = next(told, type(error).__name__)
        raise ParameterError(
            f"{where} '{name}', whose '{function}' cannot be compiled: {reason}"
        ) from error
    try:
        found = tried(model)
    except Exception as error:
        raise ParameterError(
            f"{where} '{name}', whose '{function}' raised {type(error).__name__}: {error}"
        ) from error
    if not np.all(np.isfinite(found)):
        raise ParameterError(f"{where} '{name}', whose '{function}' gives {found} at rest")
    _kept.append(compiled)
    return int(compiled.address)
