"""Messages as YAML and CSV, and from YAML; types by their names."""

from __future__ import annotations

import array
import dataclasses
import importlib
import re
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import yaml

from maglev_ros2cli.parser import CommandError

Stamper = Callable[[Any], None]
"""Sets a time of a message, as it is published, to the one it is given."""


@dataclasses.dataclass(frozen=True)
class Form:
    """How messages are printed.

    :param truncate: of longer arrays and strings only so much, None for all.
    :param no_arrays: of arrays only type and length.
    :param no_strings: of strings only the length.
    :param flow: YAML in one line.
    """

    truncate: int | None = None
    no_arrays: bool = False
    no_strings: bool = False
    flow: bool = False


def find_type(name: str, kind: str) -> Any:
    """The class of a type by its name, ``std_msgs/msg/String`` or ``std_msgs/String``.

    :param kind: ``msg`` or ``srv``.
    :raises CommandError: when there is none.
    """
    what = {'msg': 'message', 'srv': 'service'}[kind]
    parts = name.split('/')
    if len(parts) == 2:
        parts.insert(1, kind)
    if len(parts) != 3 or parts[1] != kind or not all(parts):
        raise CommandError(f'The passed {what} type is invalid')
    try:
        return getattr(importlib.import_module(f'{parts[0]}.{kind}'), parts[2])
    except (ImportError, AttributeError) as error:
        raise CommandError(f'The passed {what} type is invalid') from error


# -- printing --------------------------------------------------------------------------------------


def as_yaml(message: Any, form: Form) -> str:
    """A message as YAML with a line end."""
    return yaml.dump(
        _plain(message, form),
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=form.flow,
        sort_keys=False,
    )


def as_csv(message: Any, form: Form) -> str:
    """All values of a message, however deep, separated by commas."""
    fields = message.get_fields_and_field_types()
    return ','.join(_csv(getattr(message, name), kind, form) for name, kind in fields.items())


def _plain(value: Any, form: Form, kind: str = '') -> Any:
    """A value of a message as YAML knows it; ``kind`` is the type of a field."""
    if isinstance(value, (bytes, str)):
        return _text(value, form)
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        if form.no_arrays and kind:
            return _array_kind(kind, len(value))
        rest = form.truncate is not None and len(value) > form.truncate
        return [_plain(each, form) for each in value[: form.truncate]] + ['...'] * rest
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (bool, int, float)):
        return value
    return {
        name: _plain(getattr(value, name), form, field)
        for name, field in value.get_fields_and_field_types().items()
    }


def _csv(value: Any, kind: str, form: Form) -> str:
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        if form.no_arrays and kind:
            return _array_kind(kind, len(value))
        rest = form.truncate is not None and len(value) > form.truncate
        parts = [_csv(each, '', form) for each in value[: form.truncate]] + ['...'] * rest
        return ','.join(parts)
    if isinstance(value, str):
        return _text(value, form)
    if isinstance(value, (bytes, bool, int, float, np.generic)):
        return str(value)
    return as_csv(value, form)


def _text(value: bytes | str, form: Form) -> str:
    if isinstance(value, bytes):
        value = value.decode('latin-1')
    elif form.no_strings:
        return f'<string length: <{len(value)}>>'
    if form.truncate is not None and len(value) > form.truncate:
        return value[: form.truncate] + '...'
    return value


_ARRAY = re.compile(r'(?P<type>.*)\[(?P<size>\d+)\]')
_SEQUENCE = re.compile(r'sequence<(?P<type>.*?)(, (?P<bound>\d+))?>')


def _array_kind(kind: str, length: int) -> str:
    """An array field's type as ros2cli writes it, from ``double[4]`` or ``sequence<double, 8>``."""
    fixed = _ARRAY.fullmatch(kind)
    if fixed:
        return f'<array type: {_long(fixed["type"])}[{fixed["size"]}]>'
    sequence = _SEQUENCE.fullmatch(kind)
    assert sequence is not None, kind
    bound = f'[{sequence["bound"]}]' if sequence['bound'] else ''
    return f'<sequence type: {_long(sequence["type"])}{bound}, length: {length}>'


def _long(kind: str) -> str:
    return re.sub('<.*>', '', kind.replace('/', '/msg/'))


# -- filling ---------------------------------------------------------------------------------------


def values_of(text: str) -> dict[str, Any]:
    """What a command line gives as YAML. Raises :class:`CommandError` when it is no mapping."""
    try:
        values = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise CommandError(f'The passed value is no YAML: {error}') from error
    if not isinstance(values, dict):
        raise CommandError('The passed value needs to be a dictionary in YAML format')
    return values


def fill(message: Any, values: Any) -> list[Stamper]:
    """Set the fields of a message.

    ``auto`` for a header and ``now`` for a time are for those who publish it to set, by calling
    what is returned with the time.

    :raises CommandError: naming what cannot be set, and where Python leaves out its checks.
    """
    if not __debug__:
        raise CommandError('With PYTHONOPTIMIZE Python leaves out the checks of values: unset it')
    stampers: list[Stamper] = []
    try:
        _fill(message, values, stampers)
    except (AttributeError, TypeError, ValueError, AssertionError, OverflowError) as error:
        raise CommandError(f'Failed to populate field: {error}') from error
    return stampers


def _fill(message: Any, values: Any, stampers: list[Stamper]) -> None:
    if not isinstance(values, dict):
        kind = type(values).__name__
        raise TypeError(f"Value '{values}' is expected to be a dictionary but is a {kind}")
    # Else the code beneath takes arrays of any length and numbers of any size, or breaks off.
    message._check_fields = True
    kinds = message.get_fields_and_field_types()
    for name, value in values.items():
        field = getattr(message, name)
        kind = kinds[name]
        if kind == 'std_msgs/Header' and value == 'auto':
            stampers.append(_stamper(field, 'stamp'))
        elif kind == 'builtin_interfaces/Time' and value == 'now':
            stampers.append(_stamper(message, name))
        else:
            setattr(message, name, _field(field, kind, value, stampers))


def _field(field: Any, kind: str, value: Any, stampers: list[Stamper]) -> Any:
    """A value as a field takes it, by what the field holds now."""
    if isinstance(field, np.ndarray):
        return np.array(value, dtype=field.dtype)
    if isinstance(field, array.array):
        return array.array(field.typecode, value)
    if isinstance(field, list):
        element = re.search(r'\w+/\w+', kind)
        return [_element(each, element[0], stampers) if element else each for each in value]
    if hasattr(field, 'get_fields_and_field_types'):
        _fill(field, value, stampers)
        return field
    if isinstance(field, bytes) and isinstance(value, int):
        return bytes([value])
    return type(field)(value) if isinstance(field, (float, str)) else value


def _element(value: Any, kind: str, stampers: list[Stamper]) -> Any:
    message = find_type(kind, 'msg')()
    _fill(message, value, stampers)
    return message


def _stamper(message: Any, name: str) -> Stamper:
    return lambda time: setattr(message, name, time)
