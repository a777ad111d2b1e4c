"""Signals, closed pipes and completion: ``ros2`` as a process of its own."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from graph import Process
from ros2_command import COMMAND

from maglev_ros2cli.commands.topic_hz import summary


def test_ctrl_c_ends_it_without_a_word(small: Process, tmp_path: Path) -> None:
    process = Process([*COMMAND, 'topic', 'hz', '/stage/measurement'], tmp_path / 'log')
    process.wait_for('window')
    process.signal(signal.SIGINT)
    assert process.wait() == signal.SIGINT
    line = (
        r'average rate: \d+\.\d{3}\n'
        r'\tmin: \d\.\d{3}s max: \d\.\d{3}s std dev: \d\.\d{5}s window: \d+\n'
    )
    assert re.fullmatch(f'({line})+', process.output)


def test_a_closed_pipe_ends_it_without_a_word(small: Process) -> None:
    script = '"$@" | head -n 2; exit ${PIPESTATUS[0]}'
    words = ['topic', 'echo', '--csv', '/stage/measurement']
    result = subprocess.run(
        ['bash', '-c', script, '-', *COMMAND, *words],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (result.returncode, result.stderr) == (128 + signal.SIGPIPE, '')
    assert result.stdout.count('\n') == 2


@pytest.mark.parametrize(
    ('where', 'code', 'said'),
    [
        ('> /dev/full', 1, 'error: cannot write to the standard output: No space left on device\n'),
        ('>&-', 0, ''),
    ],
)
def test_where_nothing_can_be_printed(where: str, code: int, said: str) -> None:
    script = f'"$@" {where}'
    result = subprocess.run(
        ['bash', '-c', script, '-', *COMMAND, 'pkg', 'list'],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (result.returncode, result.stderr) == (code, said)


def test_rates() -> None:
    assert summary([0.001, 0.003]) == (
        'average rate: 500.000\n\tmin: 0.001s max: 0.003s std dev: 0.00100s window: 2'
    )


def completions(line: str, folder: Path) -> set[str]:
    """What the shell would offer at the end of a line."""
    answer = folder / 'completions'
    subprocess.run(
        COMMAND,
        env={
            **os.environ,
            '_ARGCOMPLETE': '1',
            '_ARGCOMPLETE_IFS': '\n',
            '_ARGCOMPLETE_STDOUT_FILENAME': str(answer),
            '_ARGCOMPLETE_SUPPRESS_SPACE': '1',
            'COMP_LINE': line,
            'COMP_POINT': str(len(line)),
        },
        timeout=60,
        check=False,
    )
    return set(answer.read_text().split('\n'))


@pytest.mark.parametrize(
    ('line', 'offered'),
    [
        ('ros2 top', {'topic'}),
        ('ros2 param ', {'describe', 'dump', 'get', 'list', 'load', 'set'}),
        ('ros2 topic echo --no-a', {'--no-arr'}),
        ('ros2 run rcl', {'rclpy'}),
        ('ros2 service call /small/enable std_srvs/srv/Set', {'std_srvs/srv/SetBool'}),
        ('ros2 lifecycle set /small dea', {'deactivate'}),
    ],
)
def test_completion(small: Process, tmp_path: Path, line: str, offered: set[str]) -> None:
    assert offered <= completions(line, tmp_path)


def test_a_term_ends_it(small: Process, tmp_path: Path) -> None:
    process = Process([*COMMAND, 'topic', 'echo', '/stage/measurement'], tmp_path / 'log')
    process.wait_for('---')
    process.signal(signal.SIGTERM)
    start = time.monotonic()
    assert process.wait() == 128 + signal.SIGTERM
    assert time.monotonic() - start < 10.0
    assert 'Traceback' not in process.output
