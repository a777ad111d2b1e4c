"""What the user reads."""

from __future__ import annotations

import os
import sys


def say(text: str) -> None:
    """Print at once."""
    _print(text, 1)


def complain(text: str) -> None:
    """Print to the standard error stream."""
    _print(text, 2)


def _print(text: str, descriptor: int) -> None:
    stream = sys.stdout if descriptor == 1 else sys.stderr
    try:
        print(text, file=stream, flush=True)
    except OSError:  # who read it has gone; the run goes on
        os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)
