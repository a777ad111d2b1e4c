"""What runs in a process of its own that was forked from one with most imports done."""

from __future__ import annotations

import os
import runpy
import sys


def run_script(command: list[str], environment: dict[str, str], folder: str, log: str) -> None:
    """Be the script ``command[0]``, with the arguments that follow, as if started by a shell."""
    os.setsid()
    os.chdir(folder)
    output = os.open(log, os.O_WRONLY | os.O_APPEND)
    for descriptor in (1, 2):
        os.dup2(output, descriptor)
    os.close(output)
    os.environ.clear()
    os.environ.update(environment)
    given = environment.get('PYTHONPATH', '').split(os.pathsep)
    sys.path[:0] = [entry for entry in given if entry not in sys.path]
    sys.argv = command
    runpy.run_path(command[0], run_name='__main__')
