"""How the programs end whose output nobody reads to the end."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

PARAMS = Path(__file__).resolve().parents[2] / 'params'


@pytest.mark.parametrize(
    'arguments',
    [
        ['maglev_study.faults.main', '--runs', '1', '--jobs', '1'],
        ['maglev_study.robustness.main', '--params', str(PARAMS), '--replay', '0'],
    ],
)
def test_a_closed_pipe_ends_them_without_a_word(arguments: list[str], tmp_path: Path) -> None:
    script = '"$@" | :; exit ${PIPESTATUS[0]}'
    result = subprocess.run(
        ['bash', '-c', script, '-', sys.executable, '-m', *arguments, '--out', str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (result.returncode, result.stderr) == (128 + signal.SIGPIPE, '')
