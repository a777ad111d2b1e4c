"""Programs that only print: the end of their process. No ROS here."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import NoReturn


def leave_with(command: Callable[[], int]) -> NoReturn:
    """Run a command and leave the process with its exit code.

    When whoever reads the standard output has gone, as in ``command | head``, it ends as programs
    that a broken pipe kills do: without a word, 128 + SIGPIPE to a shell.
    """
    try:
        try:
            code = command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 128 + signal.SIGPIPE
    sys.exit(code)
