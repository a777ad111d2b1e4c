"""Programs that only print: their signals, and the end of their process. No ROS here."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import NoReturn


def leave_with(command: Callable[[], int]) -> NoReturn:
    """Run a command and leave the process with its exit code.

    When whoever reads the standard output has gone, as in ``command | head``, it ends as programs
    that a broken pipe kills do: without a word, 128 + SIGPIPE to a shell; after a Ctrl-C likewise.
    """
    try:
        try:
            code = command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 128 + signal.SIGPIPE
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    sys.exit(code)


@contextlib.contextmanager
def noted(*signals: signal.Signals) -> Iterator[list[int]]:
    """Signals are noted here, where their exceptions might strike within what must be whole.

    The second of a kind does what it did before. For the main thread.
    """
    caught: list[int] = []

    def catch(number: int, _frame: object) -> None:
        caught.append(number)
        signal.signal(number, before[signal.Signals(number)])

    before = {number: signal.signal(number, catch) for number in signals}
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
