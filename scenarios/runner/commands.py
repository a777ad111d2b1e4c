"""The scripts by name, from their options to an exit code."""

from __future__ import annotations

from collections.abc import Sequence

from runner.console import complain, write
from runner.flights import FLIGHTS
from runner.options import HelpAskedError, WrongUseError
from runner.programs import PROGRAMS

COMMANDS = {**FLIGHTS, **PROGRAMS}
"""One function each: from options to what is to be done after the set-up."""

LATER = 75
"""Exit code of ``--check`` when there is more to do than to answer."""


def main(arguments: Sequence[str]) -> int:
    """Do what ``[--check] NAME OPTION...`` asks for and return the exit code.

    With ``--check`` nothing that needs the set-up is done, and :data:`LATER` returned instead.
    """
    check_only = arguments[0] == '--check'
    name, *options = arguments[check_only:]
    try:
        _check_text(options)
        job = COMMANDS[name](options)
        return LATER if check_only else job()
    except HelpAskedError as text:
        write(str(text))
        return 0
    except WrongUseError as error:
        complain(f'{name}: error: {error}')
        return 2


def _check_text(options: Sequence[str]) -> None:
    """Refuse what no node can be told."""
    for word in options:
        try:
            word.encode()
        except UnicodeEncodeError as error:
            raise WrongUseError(f"'{word}' is no text in UTF-8: name it otherwise") from error
