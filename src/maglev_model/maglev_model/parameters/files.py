"""Parameter files as ROS has them, read into tables and written from them. No ROS here."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from maglev_model.parameters import ros_yaml
from maglev_model.parameters.node_only import NODE_ONLY
from maglev_model.parameters.table import ParameterError, T, build, for_others, specs, values

DIFFERS = '# not as by default: '
"""How the lines begin with which :func:`to_yaml` names what was changed."""


def read_yaml(path: str | Path, *nodes: str) -> dict[str, object]:
    """The overrides a ROS parameter file holds for a node that has these names, by full name.

    Sections of a name (with or without a leading slash) and those whose wildcards (``*`` for a
    part of a name, ``**`` for any number of them) match one apply, in the file's order. Raises
    :class:`ParameterError` when the file is missing or is no parameter file.
    """
    try:
        content = ros_yaml.load(Path(path).read_text(encoding='utf-8')) or {}
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"cannot read parameter file '{path}': {error}") from error
    except yaml.YAMLError as error:
        raise ParameterError(f"'{path}' is no valid YAML: {error}") from error
    if not isinstance(content, dict):
        raise ParameterError(f"'{path}' is no ROS parameter file: it must map nodes to parameters")
    found: dict[str, object] = {}
    seen: set[str] = set()
    for section, body in content.items():
        if not isinstance(body, dict) or set(body) != {'ros__parameters'}:
            raise ParameterError(
                f"'{path}': section '{section}' must hold 'ros__parameters' and nothing else"
            )
        if (name := _absolute(str(section))) in seen:
            raise ParameterError(f"'{path}': section '{name}' is there twice")
        seen.add(name)
        try:
            own = _flatten(body['ros__parameters'])
        except ValueError as error:
            raise ParameterError(f"'{path}': in section '{section}' {error}") from error
        if applies(name, nodes):
            found.update(own)
    return found


def read_argument(text: str, *nodes: str) -> dict[str, object]:
    """The override that ``name:=value`` holds, or ``node:name:=value`` when it is for the node.

    Raises :class:`ParameterError` for a value that is no YAML.
    """
    names, _, value = text.partition(':=')
    section, _, name = names.rpartition(':')
    if section and not applies(section, nodes):
        return {}
    try:
        return {name: ros_yaml.load(value)}
    except yaml.YAMLError as error:
        raise ParameterError(f"'{value}' of parameter '{name}' is no valid YAML") from error


def applies(section: str, nodes: Iterable[str]) -> bool:
    """Whether a section of a parameter file is for a node that has these names, as ROS has it."""
    pattern = re.escape(_absolute(section))
    pattern = pattern.replace(r'/\*\*', '(/[^/]+)*').replace(r'\*', '[^/]+')
    return any(re.fullmatch(pattern, _absolute(node)) for node in nodes)


def _absolute(name: str) -> str:
    return '/' + name.lstrip('/')


def from_yaml(cls: type[T], node: str, *paths: str | Path) -> T:
    """Build a node's table from ROS parameter files, the later winning; raises as :func:`build`.

    What only the node itself has is left in the files where the table has nothing of it.
    """
    overrides: dict[str, object] = {}
    for path in paths:
        overrides.update(read_yaml(path, node))
    known = specs(cls)

    def others(name: str) -> bool:
        of_the_node = name.partition('.')[0] in NODE_ONLY.get(node, ())
        return for_others(name, known) or (of_the_node and name not in known)

    return build(cls, {k: v for k, v in overrides.items() if not others(k)})


def differing(instance: Any) -> dict[str, tuple[object, object]]:
    """Value and default of each parameter that is not as by default, by name."""
    table = specs(type(instance))
    return {
        name: (value, table[name].default)
        for name, value in values(instance).items()
        if value != table[name].default
    }


def to_yaml(instance: Any, node: str) -> str:
    """The whole table as a ROS parameter file for one node; first what is not as by default.

    But for lists that are empty by default and still are: ROS cannot read an empty list.
    """
    nested: dict[str, Any] = {}
    table = specs(type(instance))
    for name, value in values(instance).items():
        if value == () == table[name].default:
            continue
        *groups, last = name.split('.')
        level = nested
        for part in groups:
            level = level.setdefault(part, {})
        level[last] = list(value) if isinstance(value, tuple) else value
    content = {node: {'ros__parameters': nested}}
    lines = [
        f'{DIFFERS}{name}: {value!r} (by default {default!r})\n'
        for name, (value, default) in differing(instance).items()
    ]
    return ''.join(lines) + ros_yaml.dump(content)


def _flatten(parameters: object) -> dict[str, object]:
    """Values by full name; raises ValueError for what is none, and for a name with two values."""
    if not isinstance(parameters, dict | None):
        raise ValueError(f"'ros__parameters' is {parameters!r}, it must map names to values")
    found: dict[str, object] = {}
    for name, value in _values_in(parameters or {}, ''):
        if name in found:
            raise ValueError(f"'{name}' is given twice")
        found[name] = value
    return found


def _values_in(mapping: Mapping[Any, Any], prefix: str) -> Iterator[tuple[str, object]]:
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from _values_in(value, f'{prefix}{key}.')
        else:
            yield f'{prefix}{key}', value
