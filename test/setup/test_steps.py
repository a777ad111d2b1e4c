"""The steps of the set-up: what one of them says, and how all of them end."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


class Steps:
    """Steps of the set-up that go on beside each other."""

    def __init__(self, path: Path, script: str) -> None:
        self.log = path / 'setup.log'
        self.process = subprocess.Popen(
            [shutil.which('bash') or 'bash', '-euo', 'pipefail', '-c', self._around(path, script)],
            stderr=subprocess.PIPE,
            text=True,
        )

    def _around(self, path: Path, script: str) -> str:
        return f"""
            root={path} venv={path}/.venv log={self.log}
            . {ROOT}/setup/checks.bash
            . {ROOT}/setup/steps.bash
            trap 'interrupted INT 130' INT
            trap 'interrupted TERM 143' TERM
            trap stop_steps EXIT
            : >"$log"
            endless() {{ sleep 1000 & echo "$BASHPID" >"$root/pid"; sleep 1000; }}
            quick() {{ echo 'quickly done'; }}
            bad() {{
              until [[ -s $root/pid ]]; do sleep 0.05; done
              echo 'ValueError: no'
              false
              quick
            }}
            {script}
        """

    def end(self, path: Path) -> tuple[int, list[str]]:
        """Its exit code and lines, once it and all that its endless step started have ended."""
        _, said = self.process.communicate(timeout=30)
        group = int((path / 'pid').read_text())
        deadline = time.monotonic() + 10.0
        while time.monotonic() < deadline:
            try:
                os.killpg(group, 0)
            except ProcessLookupError:
                break
            time.sleep(0.05)
        else:
            pytest.fail('a step goes on')
        assert [each.name for each in path.glob('setup.log*')] == ['setup.log']
        return self.process.returncode, said.splitlines()


def test_a_step_that_fails_ends_those_beside_it_and_is_named(tmp_path: Path) -> None:
    steps = Steps(tmp_path, 'begin long endless; step short quick; begin wrong bad; finish')
    code, lines = steps.end(tmp_path)
    assert code == 1
    assert lines[:3] == ['setup: long', 'setup: short', 'setup: wrong']
    assert lines[3].startswith('setup: wrong failed: ValueError: no')
    assert len(lines) == 4
    assert steps.log.read_text().count('quickly done') == 1


def test_a_step_that_the_system_kills_is_explained(tmp_path: Path) -> None:
    killed = """hungry() {
        until [[ -s $root/pid ]]; do sleep 0.05; done
        bash -c 'kill -KILL $$'
        true
    }
    """
    code, lines = Steps(tmp_path, f'{killed}begin long endless; step wrong hungry').end(tmp_path)
    assert code == 1
    assert lines[-1].startswith('setup: wrong failed: the system has killed it, as where memory')


def test_a_step_whose_words_the_disk_does_not_take_is_explained(tmp_path: Path) -> None:
    limited = """mute() { until [[ -s $root/pid ]]; do sleep 0.05; done; yes | head -c 99999; }
    begin long endless
    trap '' XFSZ
    ulimit -f 8
    step wrong mute
    """
    code, lines = Steps(tmp_path, limited).end(tmp_path)
    assert code == 1
    assert lines[2].startswith('setup: wrong failed: no space left on the disk of ')
    assert len(lines) == 3


@pytest.mark.parametrize(('signal_', 'code'), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_interrupted_no_step_goes_on(tmp_path: Path, signal_: signal.Signals, code: int) -> None:
    steps = Steps(tmp_path, 'begin long endless; finish')
    while not (tmp_path / 'pid').exists() or not (tmp_path / 'pid').read_text():
        time.sleep(0.02)
    steps.process.send_signal(signal_)
    assert steps.end(tmp_path) == (
        code,
        ['setup: long', 'setup: interrupted: the next run completes it'],
    )


def test_interrupted_before_it_is_noted_a_step_ends_all_the_same(tmp_path: Path) -> None:
    signalled = (
        '[[ $BASH_COMMAND != titles* ]] || { trap - DEBUG;'
        ' until [[ -s $root/pid ]]; do sleep 0.02; done; kill -INT $$; }'
    )
    steps = Steps(tmp_path, f"set -T; trap '{signalled}' DEBUG; begin long endless; finish")
    said = ['setup: long', 'setup: interrupted: the next run completes it']
    assert steps.end(tmp_path) == (130, said)
