"""Parsers that say, of what they do not know, where it can be had; and what ends a command."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable
from typing import Any, NoReturn

SUBSET = (
    'This ros2 is a small one, for ROS 2 from pip wheels: a native installation of ROS 2 Jazzy has'
    ' every verb and option.'
)


class CommandError(RuntimeError):
    """What was asked cannot be done; the message goes to stderr, the exit code is 1."""


class Parser(argparse.ArgumentParser):
    """A parser of ``ros2``; an option must be given in full."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**{'allow_abbrev': False, **arguments})

    def flag(self, *names: str, help: str) -> None:
        """An option without a value."""
        self.add_argument(*names, action='store_true', help=help)

    def error(self, message: str) -> NoReturn:
        """End with exit code 2; of an unknown verb or option, say that there are more elsewhere."""
        self.print_usage(sys.stderr)
        unknown = 'invalid choice' in message or 'unrecognized arguments' in message
        self.exit(2, f'{self.prog}: error: {message}\n' + (f'{SUBSET}\n' if unknown else ''))


class Verbs:
    """The verbs of a command, added to its parser one by one."""

    def __init__(self, parser: Parser) -> None:
        self._command = parser.prog
        title = f'Call `{parser.prog} <command> -h` for more detailed usage.'
        self._verbs = parser.add_subparsers(
            title='Commands', metavar=title, dest='verb', parser_class=Parser
        )
        parser.set_defaults(run=lambda _: parser.print_help())

    def add(self, name: str, run: Callable[[Any], int | None], text: str) -> Parser:
        """A verb that is carried out by a function of its parsed arguments."""
        parser: Parser = self._verbs.add_parser(
            name, help=text, description=text, prog=f'{self._command} {name}'
        )
        parser.set_defaults(run=run)
        return parser


def complete(action: argparse.Action, values: Callable[[Any], Iterable[str]]) -> None:
    """Let the shell complete an argument with ``values`` of the arguments before it."""

    def completer(parsed_args: Any, **_: Any) -> list[str]:
        try:
            return list(values(parsed_args))
        except CommandError:
            return []

    action.completer = completer  # type: ignore[attr-defined]
