"""Programs that only print: their signals, and the end of their process. No ROS here."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
from collections.abc import Callable, Iterator
from typing import NoReturn

_STANDARD_ERROR = 2  # its number, the last of the three


def leave_with(command: Callable[[], int]) -> NoReturn:
    """Run a command and leave the process with its exit code.

    When whoever reads the standard output has gone, as in ``command | head``, it ends as programs
    that a broken pipe kills do: without a word, 128 + SIGPIPE to a shell; after a Ctrl-C likewise.
    What cannot be written, as to a disk that is full, is told in a line, with 1. A Ctrl-C that
    whoever started it holds back while modules are imported, by blocking SIGINT, is heeded here.
    """
    open_streams()
    try:
        try:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            code = command()
        finally:
            sys.stdout.flush()
    except BrokenPipeError:
        write_no_more()
        code = 128 + signal.SIGPIPE
    except KeyboardInterrupt:
        code = 128 + signal.SIGINT
    except OSError as error:
        if not (said := unwritten(error)):
            raise
        write_no_more()
        print(said, file=sys.stderr)
        code = 1
    sys.exit(code)


def open_streams() -> None:
    """Let standard streams that whoever started the program has closed lead nowhere.

    The next file or socket would have their number, and what is printed be written to that.
    """
    while (nowhere := os.open(os.devnull, os.O_RDWR)) <= _STANDARD_ERROR:
        pass
    sys.stdout = sys.stdout or os.fdopen(os.dup(nowhere), 'w')
    sys.stderr = sys.stderr or os.fdopen(os.dup(nowhere), 'w')
    os.close(nowhere)


def unwritten(error: OSError) -> str:
    """What to say of output that cannot be written, as to a full disk; '' for any other error."""
    if error.errno not in (errno.ENOSPC, errno.EDQUOT) or error.filename is not None:
        return ''
    return f'error: cannot write to the standard output: {error.strerror}'


def write_no_more() -> None:
    """Let what goes to the standard output go nowhere: what has failed would fail once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
