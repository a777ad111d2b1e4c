"""The signals that end a process of nodes."""

from __future__ import annotations

import signal

_ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU)


def listen(suspends: bool = True) -> list[int]:
    """Where the numbers of signals are noted from now on; SIGHUP may be ignored, as by nohup.

    ``suspends``: Ctrl-Z and Ctrl-\\, SIGTSTP and SIGQUIT, do what they do to any other process, or
    else are among them.
    """
    caught: list[int] = []

    def catch(number: int, _frame: object) -> None:
        if number != signal.SIGXCPU or number not in caught:  # which comes every second
            caught.append(number)

    for number in _ENDING if suspends else (*_ENDING, signal.SIGTSTP, signal.SIGQUIT):
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, catch)
    return caught
