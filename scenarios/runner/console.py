"""What the user reads."""

from __future__ import annotations

import os
import sys


def say(text: str, descriptor: int = 1) -> None:
    """Print at once, to the standard output or to another stream."""
    stream = sys.stdout if descriptor == 1 else sys.stderr
    try:
        print(text, file=stream, flush=True)
    except OSError:  # who read it has gone; the run goes on
        os.dup2(os.open(os.devnull, os.O_WRONLY), descriptor)


def complain(text: str) -> None:
    """Print to the standard error stream."""
    say(text, 2)
