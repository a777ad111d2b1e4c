"""Nothing is compiled in flight, or while a watchdog waits: that would be seconds of silence."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

SUPPORT = Path(__file__).resolve().parents[1] / 'support'


@pytest.mark.parametrize(
    ('script', 'case'),
    [
        *(('compiled_in_flight.py', law) for law in ('own', 'accelerations', 'currents')),
        *(('compiled_on_boards.py', what) for what in ('landing', 'commission')),
    ],
)
def test_nothing_is_compiled_in_flight(script: str, case: str) -> None:
    command = [sys.executable, str(SUPPORT / script), case]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300.0)
    assert done.returncode == 0, done.stderr
    assert done.stdout == 'nothing\n'
