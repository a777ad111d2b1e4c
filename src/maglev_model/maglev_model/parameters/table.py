"""Typed parameters: one frozen dataclass is the table of a node's parameters.

A field made with :func:`parameter` carries unit, bounds and description beside its type and
default; a field whose type is itself such a dataclass is a group, and its parameters are named
``group.name``. The same table serves the ROS node (declared, validated, set at run time) and the
library (built from a YAML file or from keywords). No ROS here.
"""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import re
import sys
import typing
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, TypeVar

T = TypeVar('T')

SHARED_GROUPS = ('machine', 'guide', 'effects', 'internal_model', 'y', 'x', 'z', 'phi', 'theta')
"""Groups that a parameter file may give to all nodes at once, under ``/**``.

A node that has no such group leaves it to the others; one that has it refuses what is wrong in it.
"""

SHARED: Final = ('sample_time',)
"""Single parameters of all nodes, likewise."""

_METADATA_KEY = 'maglev_parameter'
_SCALARS: dict[type, str] = {bool: 'bool', int: 'integer', float: 'double', str: 'string'}


class ParameterError(ValueError):
    """A parameter is unknown, of the wrong type or out of its bounds; the message names it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Spec:
    """One parameter: its full name, element type, default, and what its value may be.

    ``kind`` is bool, int, float or str. ``array`` tells a tuple of such elements, ``length`` its
    exact length when it is fixed. Bounds are inclusive and hold for every element.
    """

    name: str
    kind: type
    array: bool
    default: Any
    description: str
    unit: str = ''
    lower: float | None = None
    upper: float | None = None
    choices: tuple[str, ...] = ()
    length: int | None = None
    read_only: bool = False

    @property
    def type_name(self) -> str:
        """The type as ROS writes it, for instance ``double[]``."""
        return _SCALARS[self.kind] + ('[]' if self.array else '')

    @property
    def bounds_text(self) -> str:
        """The bounds as text, empty when there are none."""
        if self.choices:
            return 'one of ' + ', '.join(self.choices)
        if self.lower is None and self.upper is None:
            return ''
        lower = '-inf' if self.lower is None else f'{self.lower:g}'
        upper = 'inf' if self.upper is None else f'{self.upper:g}'
        return f'[{lower}, {upper}]' + (f' {self.unit}' if self.unit else '')

    def check(self, value: object) -> Any:
        """Return ``value`` as this parameter holds it, or raise :class:`ParameterError`."""
        if not self.array:
            return self._check_element(value, self.name)
        if isinstance(value, str | bytes) or not isinstance(value, Iterable):
            raise self._wrong_type(value, self.name)
        elements = tuple(
            self._check_element(element, f'{self.name}[{index}]')
            for index, element in enumerate(value)
        )
        if self.length is not None and len(elements) != self.length:
            raise ParameterError(
                f"parameter '{self.name}' has {len(elements)} elements, it takes {self.length}"
            )
        return elements

    def _wrong_type(self, value: object, where: str) -> ParameterError:
        return ParameterError(
            f"parameter '{where}' is {value!r} ({type(value).__name__}),"
            f' its type is {self.type_name}'
        )

    def _milli(self, value: float) -> str:
        """A hint at millimetres or milliradians, where a thousandth would be within the bounds."""
        lower = -math.inf if self.lower is None else self.lower
        upper = math.inf if self.upper is None else self.upper
        length = re.match('(m|rad)(,|$)', self.unit)
        fits = length and lower <= 1e-3 * value <= upper
        return f'; if that is in m{length[1]}, write {1e-3 * value:g}' if length and fits else ''

    def _check_element(self, value: object, where: str) -> Any:
        if hasattr(value, 'item') and not isinstance(value, str | bytes):  # a NumPy scalar
            value = value.item()
        if isinstance(value, int) and abs(value) > sys.float_info.max:
            raise ParameterError(f"parameter '{where}' is a whole number that no double holds")
        if self.kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value)
        if type(value) is not self.kind:
            raise self._wrong_type(value, where)
        if isinstance(value, float) and not math.isfinite(value):
            raise ParameterError(f"parameter '{where}' is {value}, it must be finite")
        if isinstance(value, int | float) and not isinstance(value, bool):
            too_low = self.lower is not None and value < self.lower
            too_high = self.upper is not None and value > self.upper
            if too_low or too_high:
                raise ParameterError(
                    f"parameter '{where}' is {value:g}, it must lie in {self.bounds_text}"
                    f'{self._milli(value)}'
                )
        if self.choices and value not in self.choices:
            raise ParameterError(f"parameter '{where}' is '{value}', it must be {self.bounds_text}")
        return value


def parameter(
    default: Any = dataclasses.MISSING,
    description: str = '',
    *,
    unit: str = '',
    within: tuple[float, float] | None = None,
    lower: float | None = None,
    upper: float | None = None,
    choices: Sequence[str] = (),
    length: int | None = None,
    read_only: bool = False,
) -> Any:
    """A dataclass field that is a parameter. ``unit`` is the SI unit, bounds are inclusive.

    ``within`` gives both bounds, ``lower`` or ``upper`` one.
    """
    lower, upper = within or (lower, upper)
    metadata = {
        _METADATA_KEY: {
            'description': description,
            'unit': unit,
            'lower': lower,
            'upper': upper,
            'choices': tuple(choices),
            'length': length,
            'read_only': read_only,
        }
    }
    return dataclasses.field(default=default, metadata=metadata)


def group(cls: type[T]) -> T:
    """A dataclass field that is a group of parameters, with the group's own defaults."""
    return dataclasses.field(default_factory=cls)


@functools.cache
def _hints(cls: Any) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def specs(cls: type, prefix: str = '') -> dict[str, Spec]:
    """All parameters of a table, by full name, in the order they are written."""
    hints = _hints(cls)
    found: dict[str, Spec] = {}
    for field in dataclasses.fields(cls):
        name = prefix + field.name
        hint = hints[field.name]
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            found.update(specs(hint, name + '.'))
            continue
        if _METADATA_KEY not in field.metadata:
            raise TypeError(f'{cls.__name__}.{field.name} is neither a parameter nor a group')
        array = typing.get_origin(hint) is tuple
        kind = typing.get_args(hint)[0] if array else hint
        if kind not in _SCALARS:
            raise TypeError(f'{cls.__name__}.{field.name} has type {hint}, which ROS does not hold')
        found[name] = Spec(
            name=name,
            kind=kind,
            array=array,
            default=field.default,
            **field.metadata[_METADATA_KEY],
        )
    return found


def values(instance: Any, prefix: str = '') -> dict[str, Any]:
    """The values of a table by full name."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(instance):
        value = getattr(instance, field.name)
        if dataclasses.is_dataclass(value):
            found.update(values(value, prefix + field.name + '.'))
        else:
            found[prefix + field.name] = value
    return found


def build(cls: type[T], overrides: Mapping[str, object] | None = None) -> T:
    """Build a table from values by full name; what is not named keeps its default.

    Raises :class:`ParameterError` for an unknown name (with the nearest right one), a wrong type,
    a value that is not finite or out of bounds, and whatever ``__post_init__`` refuses.
    """
    table = specs(cls)
    overrides = dict(overrides or {})
    for name in overrides:
        if name not in table:
            raise unknown_parameter(name, table)
    checked = {name: table[name].check(value) for name, value in overrides.items()}
    for name, spec in table.items():
        if spec.default is dataclasses.MISSING and name not in checked:
            raise ParameterError(f"parameter '{name}' has no default and must be given")
    return _assemble(cls, checked, '')


def replace(instance: T, overrides: Mapping[str, object]) -> T:
    """A copy of a table with some values changed, checked like :func:`build`."""
    return build(type(instance), {**values(instance), **overrides})


def for_others(name: str, known: Iterable[str]) -> bool:
    """Whether a parameter is shared, or of a shared group, and these names have nothing of it."""
    if name in SHARED:
        return name not in known
    group_name, dot, _ = name.partition('.')
    return (
        bool(dot)
        and group_name in SHARED_GROUPS
        and not any(other.startswith(group_name + '.') for other in known)
    )


def unknown_parameter(name: str, known: Iterable[str]) -> ParameterError:
    """The error for a name that is no parameter, with the nearest one that is."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    hint = f", did you mean '{near[0]}'?" if near else ''
    return ParameterError(f"there is no parameter '{name}'{hint}")


def _assemble(cls: type[T], checked: Mapping[str, object], prefix: str) -> T:
    hints = _hints(typing.cast(Any, cls))
    keywords: dict[str, Any] = {}
    for field in dataclasses.fields(typing.cast(Any, cls)):
        name = prefix + field.name
        hint = hints[field.name]
        if dataclasses.is_dataclass(hint) and isinstance(hint, type):
            keywords[field.name] = _assemble(hint, checked, name + '.')
        elif name in checked:
            keywords[field.name] = checked[name]
    return cls(**keywords)
