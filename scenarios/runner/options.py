"""Options as ``--name value`` or ``--name=value``. Wrong ones are refused in one line."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

DURATION = (0.01, 36000.0)
"""From and to, as the parameter of the reference [s]."""

Check = Callable[[str, str], str]
"""Makes of an option's name and value the value that is used; raises :class:`WrongUseError`."""


class WrongUseError(Exception):
    """What the user asked for cannot be done; the message says why."""


class HelpAskedError(Exception):
    """The user asked for help; the message is that help."""


class Option(NamedTuple):
    """What --help says of an option, its argument, empty for a flag, and how that is checked."""

    help: str
    argument: str = ''
    check: Check = lambda _, value: value
    several: bool = False


class Command(NamedTuple):
    """What a script is called with."""

    call: str
    description: str
    options: Mapping[str, Option]

    def usage(self) -> str:
        """What --help says."""
        rows = [(f'{name} {one.argument}'.rstrip(), one.help) for name, one in self.options.items()]
        rows.append(('--help', 'this text'))
        width = 4 + max(len(left) for left, _ in rows)
        lines = [
            f'  {left}'.ljust(width) + text.replace('\n', '\n' + ' ' * width) for left, text in rows
        ]
        call = f'usage: scenarios/{self.call} [options]'
        return '\n'.join([self.description, '', call, *lines])

    def parse(self, arguments: Sequence[str]) -> dict[str, list[str]]:
        """The checked values of each option that is given, in their order.

        Raises :class:`WrongUseError`, and :class:`HelpAskedError` for ``--help``.
        """
        found: dict[str, list[str]] = {}
        rest = list(arguments)
        while rest:
            first = rest.pop(0)
            if first in ('--help', '-h'):
                raise HelpAskedError(self.usage())
            name, attached, value = first.partition('=')
            if name not in self.options:
                raise WrongUseError(f"unknown option '{name}'; see --help")
            _, argument, check, several = self.options[name]
            values = found.setdefault(name, [])
            if not argument:
                if attached:
                    raise WrongUseError(f'{name} takes no value; see --help')
                continue
            if not attached:
                if not rest:
                    raise WrongUseError(f'{name} needs a value; see --help')
                value = rest.pop(0)
            values.append(check(name, value))
            while several and rest and not rest[0].startswith('-'):
                values.append(check(name, rest.pop(0)))
        return found


def one_of(*choices: str) -> Check:
    """One of these words."""

    def check(name: str, value: str) -> str:
        if value not in choices:
            raise WrongUseError(f"{name} is '{value}', it must be one of: {' '.join(choices)}")
        return value

    return check


def seconds(name: str, value: str) -> str:
    """A duration that the reference takes [s], as ROS reads a double: with a point."""
    low, high = DURATION
    if not re.fullmatch(r'[0-9]+\.?[0-9]*', value) or not low <= float(value) <= high:
        raise WrongUseError(
            f"{name} is '{value}', it must be seconds from {low:g} to {high:g}, as 2.5"
        )
    return f'{value}0' if '.' in value else f'{value}.0'


def whole(name: str, value: str) -> str:
    """A whole number, 0 or above."""
    if not re.fullmatch('[0-9]+', value):
        raise WrongUseError(f"{name} is '{value}', it must be a whole number of at least 0")
    return value


def number_of(name: str, value: str) -> str:
    """How many there are, at least one."""
    if not int(whole(name, value)):
        raise WrongUseError(f"{name} is '{value}', it must be at least 1")
    return value


def namespace(name: str, value: str) -> str:
    """A namespace of ROS, made absolute."""
    full = value if value.startswith('/') else f'/{value}'
    if not re.fullmatch(r'(/[A-Za-z_][A-Za-z0-9_]*)+', full) or '__' in full:
        raise WrongUseError(
            f"{name} is '{value}', it must be names of letters, digits and single '_', none"
            " beginning with a digit, with '/' between them"
        )
    return full


def folder(name: str, value: str) -> str:
    """The name of a folder, other than the root of all."""
    if not value:
        raise WrongUseError(f'{name} needs a folder')
    if os.path.realpath(value) == '/':
        raise WrongUseError(f"{name} is '{value}', it must be a folder other than the root")
    return value
