"""What the user reads."""

from __future__ import annotations

import os
import sys

GREEN, RED = '32', '31'


class _Console:
    """Where what is said goes: a descriptor, None for nowhere."""

    talk: int | None = 1


def talk_to(descriptor: int | None) -> None:
    """Let what is said go to another stream, or with None nowhere; errors are told all the same."""
    _Console.talk = descriptor


def quiet() -> bool:
    """Whether nothing but errors is told."""
    return _Console.talk is None


def say(text: str, colour: str = '') -> None:
    """Print at once; in colour on a terminal."""
    if _Console.talk is not None:
        write(text, _Console.talk, colour)


def complain(text: str) -> None:
    """Print to the standard error stream, in red on a terminal."""
    write(text, 2, RED)


def write(text: str, descriptor: int = 1, colour: str = '') -> None:
    """Print at once to the standard output or to another stream; in colour on a terminal."""
    stream = sys.stdout if descriptor == 1 else sys.stderr
    if colour and stream.isatty() and not os.environ.get('NO_COLOR'):
        text = f'\033[{colour}m{text}\033[0m'
    try:
        print(text, file=stream, flush=True)
    except OSError:  # who read it has gone; the run goes on
        os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
