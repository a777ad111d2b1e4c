"""Programs of the workspace, run in sessions of their own: a Ctrl-C reaches the runner alone."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from runner.options import WrongUseError
from runner.signals import Signals

PATIENCE = {signal.SIGTERM: 8.0, signal.SIGINT: 3.0, signal.SIGKILL: 3.0}
"""How a program is asked to end, and for how long each time [s].

Of SIGTERM, one that does not listen yet ends without a word; Python tells of SIGINT by a traceback.
"""
SHARED_MEMORY = '/dev/shm'
ENVIRONMENT = {
    'PYTHONUNBUFFERED': '1',
    'RCUTILS_COLORIZED_OUTPUT': '0',
    'RCUTILS_LOGGING_USE_STDOUT': '0',
    'RCUTILS_CONSOLE_OUTPUT_FORMAT': '{severity} {time} {message}',
}


def installed(package: str, executable: str) -> str:
    """Path of an executable of the workspace; raises :class:`WrongUseError` where there is none."""
    for prefix in os.environ.get('AMENT_PREFIX_PATH', '').split(':'):
        path = f'{prefix}/lib/{package}/{executable}'
        if os.access(path, os.X_OK):
            return path
    raise WrongUseError(
        f"no executable '{executable}' of package '{package}' in this workspace:"
        ' build it, or choose another --stage'
    )


def program(package: str, executable: str) -> list[str]:
    """How to run an executable so that it ends when the runner does, even by SIGKILL.

    It is what ``ros2 run`` runs, without the wait for that.
    """
    bound = ['setpriv', '--pdeathsig', 'TERM'] if shutil.which('setpriv') else []
    return [*bound, installed(package, executable)]


class Process:
    """A program that was started; its output goes to ``log`` where that is given."""

    def __init__(self, command: Sequence[str], log: Path | None = None) -> None:
        """Start it; raises OSError when it cannot be."""
        with contextlib.ExitStack() as opened:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=opened.enter_context(log.open('wb')) if log else None,
                stderr=subprocess.STDOUT if log else None,
                env={**os.environ, **ENVIRONMENT},
                start_new_session=True,
            )

    @property
    def code(self) -> int | None:
        """Its exit code as a shell gives it, None while it runs."""
        code = self._process.poll()
        return 128 - code if code is not None and code < 0 else code

    def stop(self, pause: Callable[[float], None]) -> None:
        """End it and what it started, by ever stronger means; ``pause`` passes the time."""
        for number, patience in PATIENCE.items():
            if self.code is not None:
                break
            self._signal(number)
            deadline = time.monotonic() + patience
            while self.code is None and time.monotonic() < deadline:
                pause(0.05)
        self._signal(signal.SIGKILL)  # what it may have started itself

    def _signal(self, number: signal.Signals) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, number)


def run_to_end(command: Sequence[str], signals: Signals, log: Path | None = None) -> int | None:
    """Exit code of a program, None when a signal came before its end."""
    process = Process(command, log)
    try:
        while process.code is None and not signals.code:
            signals.pause(0.1)
        return process.code
    finally:
        process.stop(signals.pause)


def why_killed(code: int | None) -> str:
    """What the system ended a program for without a word of its own; empty where nobody knows.

    The tracing library of ROS takes pages of shared memory when a node starts, and has a bus error
    where none is free.
    """
    if code != 128 + signal.SIGBUS or not os.path.isdir(SHARED_MEMORY):
        return ''
    full = not shutil.disk_usage(SHARED_MEMORY).free
    return f'{SHARED_MEMORY} is full: remove what ended programs have left there' if full else ''


def last_words(log: Path) -> str:
    """The line of a log that says why its program ended, uncoloured; empty when there is none."""
    try:
        text = log.read_text(errors='replace')
    except OSError:
        return ''
    lines = [line for line in re.sub(r'\033\[[\d;]*m', '', text).splitlines() if line.strip()]
    reasons = [line for line in lines if re.search('error|fatal|refused', line, re.IGNORECASE)]
    return (reasons or lines or [''])[-1]
