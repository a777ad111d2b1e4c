"""Which software a run was flown with: the version, and the commit of a checkout."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from maglev_model.programs.revision import revision


def git(folder: Path, *arguments: str) -> None:
    name = ('-c', 'user.name=nobody', '-c', 'user.email=nobody@example.org')
    subprocess.run(['git', '-C', str(folder), *name, *arguments], check=True, capture_output=True)


def test_a_checkout_is_named_by_its_commit_and_whether_it_was_changed(tmp_path: Path) -> None:
    file = tmp_path / 'src' / 'code.py'
    file.parent.mkdir()
    file.write_text('')
    git(tmp_path, 'init', '-q')
    git(tmp_path, 'add', '.')
    git(tmp_path, 'commit', '-q', '-m', 'All')
    git(tmp_path, 'tag', 'v7.1')
    assert revision(file).endswith('v7.1')
    file.write_text('changed')
    assert revision(file).endswith('v7.1-dirty')


@pytest.mark.parametrize('why', ['no checkout', 'no git', 'no history'])
def test_elsewhere_there_is_the_version_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, why: str
) -> None:
    if why != 'no checkout':
        git(tmp_path, 'init', '-q')
    if why == 'no git':
        monkeypatch.setenv('PATH', '/nowhere')
    assert 'dirty' not in revision(tmp_path / 'code.py')
    assert len(revision(tmp_path / 'code.py').split(', ')) == 1
