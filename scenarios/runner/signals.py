"""Signals that ask the runner to end are heeded between two steps, never in the middle of one."""

from __future__ import annotations

import os
import select
import signal
from types import FrameType


class Signals:
    """Takes note of SIGINT, SIGTERM and SIGHUP from now on; for one life of the main thread."""

    def __init__(self) -> None:
        self.code = 0
        """128 + the number of the first of them, as a shell's exit code; 0 before."""
        self._awake, wake = os.pipe()
        os.set_blocking(self._awake, False)
        os.set_blocking(wake, False)
        signal.set_wakeup_fd(wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda number, frame: None)
        # Where it is started with `&` in a script, SIGINT is ignored and nothing else could end it.
        signal.signal(signal.SIGINT, self._note)
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self._note)

    def pause(self, duration: float) -> None:
        """Sleep for ``duration`` [s], or until a signal comes or a process ends."""
        if select.select([self._awake], [], [], duration)[0]:
            os.read(self._awake, 4096)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.code = self.code or 128 + number
