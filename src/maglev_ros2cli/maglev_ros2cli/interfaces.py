"""Definitions of messages, services and actions, as they are installed."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ament_index_python import get_resource, get_resources
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

from maglev_ros2cli.parser import CommandError

KINDS = {'msg': 'Messages', 'srv': 'Services', 'action': 'Actions'}
"""The kinds of interfaces, with what they are called."""

_PRIMITIVE = re.compile(
    r'(bool|byte|char|w?string(<=\d+)?|u?int(8|16|32|64)|float(32|64))(\[.*\])?'
)


def names(kind: str) -> list[str]:
    """All interfaces of a kind, ``std_msgs/msg/String``, sorted."""
    found = set()
    for package in get_resources('rosidl_interfaces'):
        content, _ = get_resource('rosidl_interfaces', package)
        for line in content.splitlines():
            path = Path(line)
            if path.parts[:1] == (kind,) and path.suffix in ('.idl', f'.{kind}'):
                found.add(f'{package}/{kind}/{path.stem}')
    return sorted(name for name in found if '_' not in name.rpartition('/')[2])


def definition(name: str) -> list[str]:
    """The lines of an interface's definition. Raises :class:`CommandError` for an unknown one."""
    parts = name.split('/')
    if len(parts) != 3:
        raise CommandError(f"Invalid name '{name}'. Expected three parts separated by '/'")
    package, kind, short = parts
    try:
        folder = Path(get_package_share_directory(package)) / kind
    except (PackageNotFoundError, ValueError):
        raise CommandError(f"Unknown package '{package}'") from None
    try:
        text = (folder / f'{short}.{kind}').read_text(encoding='utf-8')
    except OSError:
        path = folder / f'{short}.idl'
        raise CommandError(f"Could not find the interface '{path}'") from None
    return [line.rstrip() for line in text.splitlines()]


def shown(name: str, *, comments: bool, nested_comments: bool, depth: int = 0) -> Iterator[str]:
    """An interface's definition line by line, each nested type's below the field, indented."""
    for line in definition(name):
        code = _code(line)
        if comments:
            yield '\t' * depth + line if line else ''
        elif code:
            yield '\t' * depth + code
        inner = _nested(code, name.split('/')[0])
        if inner:
            yield from shown(
                inner, comments=nested_comments, nested_comments=nested_comments, depth=depth + 1
            )


def _code(line: str) -> str:
    """A line without its comment; a # in quotes begins none."""
    match = re.match(r'(?:[^#\'"]|\'[^\']*\'|"[^"]*")*', line)
    return match[0].strip() if match else ''


def _nested(code: str, package: str) -> str:
    """The type of a field when it is no primitive one, by its full name; empty otherwise."""
    kind = code.split(' ')[0]
    if not code or code == '---' or _PRIMITIVE.fullmatch(kind):
        return ''
    kind = kind.partition('[')[0]
    if kind == 'Header':
        return 'std_msgs/msg/Header'
    return kind.replace('/', '/msg/') if '/' in kind else f'{package}/msg/{kind}'
