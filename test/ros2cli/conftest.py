"""``ros2`` in this process, and a node to look at."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from graph import Process
from ros2_command import Ros2, ros2_command

NODE = Path(__file__).resolve().parents[1] / 'support' / 'small_stage.py'


@pytest.fixture
def ros2(capfd: pytest.CaptureFixture[str]) -> Ros2:
    """Carry out a command line, given as words."""
    return ros2_command(capfd)


@pytest.fixture(scope='module')
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Process]:
    """The node ``/small``, active, for the tests of a file: it must not meet those of others."""
    process = Process([sys.executable, str(NODE)], tmp_path_factory.mktemp('small') / 'log')
    try:
        process.wait_for('activate: active')
        yield process
    finally:
        process.kill()
