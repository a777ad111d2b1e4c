"""Our ``ros2``, in this process."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import pytest

from maglev_ros2cli.cli import run

COMMAND = [sys.executable, '-m', 'maglev_ros2cli']
"""How it is started as a process of its own."""


class Answer(NamedTuple):
    """What a command came to."""

    code: object
    out: str
    err: str


Ros2 = Callable[..., Answer]
"""Carries out a command line that is given as words."""


def ros2_command(capfd: pytest.CaptureFixture[str]) -> Ros2:
    """The command, with what it prints."""

    def carry_out(*words: str) -> Answer:
        code: object
        try:
            code = run(words)
        except SystemExit as end:
            code = end.code
        return Answer(code, *capfd.readouterr())

    return carry_out
