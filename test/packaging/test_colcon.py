"""``colcon test`` in a workspace that holds a clone runs the packages' own tests."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from source_tree import ROOT

PASSES_AND_FAILS = """
import numpy as np
import made_up_support
from maglev_model.axes import AXES

def test_passes(): assert len(AXES) == made_up_support.COUNT
def test_fails(): assert len(AXES) == 6
def test_warns(): np.float64(1.0) / 0.0
"""


def colcon(workspace: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run colcon in a workspace, whatever workspaces are in this environment."""
    ours = ('COLCON_PREFIX_PATH', 'AMENT_PREFIX_PATH', 'CMAKE_PREFIX_PATH', 'PYTEST_ADDOPTS')
    start = 'from colcon_core.command import main; raise SystemExit(main())'
    return subprocess.run(
        [sys.executable, '-c', start, '--log-base', 'log', *arguments],
        cwd=workspace,
        env={name: value for name, value in os.environ.items() if name not in ours},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_a_packages_own_tests_are_run_and_a_failure_is_one(tmp_path: Path) -> None:
    clone = tmp_path / 'src' / 'maglev-stage'
    shutil.copytree(ROOT / 'src' / 'maglev_model', clone / 'src' / 'maglev_model', symlinks=True)
    shutil.copy(ROOT / 'pyproject.toml', clone)
    for name, text in (
        ('model/test_made_up.py', PASSES_AND_FAILS),
        ('support/made_up_support.py', 'COUNT = 5\n'),
        ('plant/test_of_another.py', 'def test_of_another(): assert False\n'),
    ):
        path = clone / 'test' / name
        path.parent.mkdir(parents=True)
        path.write_text(text)
    built = colcon(tmp_path, 'build', '--symlink-install')
    assert built.returncode == 0, built.stderr
    colcon(tmp_path, 'test')
    told = colcon(tmp_path, 'test-result', '--verbose')
    assert 'Summary: 3 tests, 0 errors, 2 failures, 0 skipped' in told.stdout
    assert 'test_made_up test_fails' in told.stdout
    assert 'RuntimeWarning' in told.stdout
    assert told.returncode == 1
