"""What the checks of style look at."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from source_tree import ROOT


def test_nothing_that_is_made_is_looked_at_without_git(tmp_path: Path) -> None:
    """As in a tree from an archive, whose .gitignore ruff does not heed."""
    ruff = shutil.which('ruff')
    if ruff is None:
        pytest.skip('ruff comes with the test tools')
    shutil.copy(ROOT / 'pyproject.toml', tmp_path)
    for folder in ('.cache/test-tools', '.venv/lib', 'build', 'install', 'log', 'runs', 'src'):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / 'module.py').touch()
    listed = subprocess.run(
        [ruff, 'check', '--show-files', '.'],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    found = [Path(line).relative_to(tmp_path) for line in listed.stdout.split()]
    assert found == [Path('pyproject.toml'), Path('src/module.py')]
