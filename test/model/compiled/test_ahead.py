"""What is compiled ahead needs no Numba; what is not, is compiled when it is called."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from maglev_model.compiled import ahead

MODULE = """
from maglev_model.compiled import borrowing, compiled

@borrowing
def half(value):
    return value / 2.0

@compiled
def quarter(value):
    return half(half(value))

@compiled
def eighth(value):
    return quarter(half(value))
"""
BUILD = """
from maglev_model.compiled import ahead, build_ahead
build_ahead.record()
import taken
assert taken.quarter(3.0) == 0.75
build_ahead.build('taken_ahead', ahead.folder(), build_ahead.called())
"""
USE = """
import sys
from maglev_model.compiled import ahead
print(ahead.use())
import taken
print(taken.quarter(3.0), 'numba' in sys.modules, type(taken.quarter).__name__)
print(taken.eighth(3.0), taken.half(5.0), 'numba' in sys.modules)
"""


def run(script: str, folder: Path, *arguments: str) -> str:
    """What a script prints that finds the module, and keeps what is compiled, in a folder."""
    path = os.pathsep.join((str(folder), os.environ.get('PYTHONPATH', '')))
    given = {**os.environ, 'PYTHONPATH': path, 'NUMBA_CACHE_DIR': str(folder / 'cache')}
    done = subprocess.run(
        [sys.executable, '-c', script, *arguments],
        capture_output=True,
        text=True,
        env=given,
        timeout=120.0,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope='module')
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp('ahead')
    (folder / 'taken.py').write_text(MODULE)
    assert run(USE, folder).split('\n')[:2] == ['False', '0.75 True CPUDispatcher']
    run(BUILD, folder)
    return folder


def test_what_was_called_needs_no_numba_and_what_was_not_is_compiled(built: Path) -> None:
    assert run(USE, built).splitlines() == [
        'True',
        '0.75 False builtin_function_or_method',
        '0.375 2.5 True',
    ]


def test_a_file_that_cannot_be_loaded_is_done_without(built: Path) -> None:
    (file,) = (built / 'cache').glob(f'*/*{ahead.SUFFIX}')
    whole = file.read_bytes()
    file.write_bytes(b'nothing')
    assert run(USE, built).splitlines()[:2] == ['False', '0.75 True CPUDispatcher']
    file.write_bytes(whole)


@pytest.mark.parametrize('other', ['_processor', 'sources_digest'])
def test_what_was_compiled_for_another_processor_or_of_other_sources_is_not_used(
    monkeypatch: pytest.MonkeyPatch, other: str
) -> None:
    monkeypatch.setenv('NUMBA_CACHE_DIR', 'here')
    ours = ahead.folder()
    monkeypatch.setattr(ahead, other, lambda: 'another')
    assert ahead.folder() != ours
    monkeypatch.delenv('NUMBA_CACHE_DIR')
    assert ahead.folder() is None


CALLS = """
import sys
from maglev_model import compiled
compiled.sources_digest = lambda: sys.argv[1]
import calling
print(calling.twice(3.0))
"""
CALLING = """
from called import changed
from maglev_model.compiled import compiled

@compiled
def twice(value):
    return 2.0 * changed(value)
"""
CALLED = """
from maglev_model.compiled import compiled

@compiled
def changed(value):
    return value + {}
"""


def test_what_calls_changed_sources_is_compiled_anew_also_in_a_shell_that_is_older(
    tmp_path: Path,
) -> None:
    (tmp_path / 'calling.py').write_text(CALLING)
    for state, added, expected in (('old', 0.0, 6.0), ('new', 1.0, 8.0)):
        (tmp_path / 'called.py').write_text(CALLED.format(added))
        assert float(run(CALLS, tmp_path, state)) == expected


def test_one_call_of_several_kinds_is_refused(built: Path) -> None:
    several = BUILD.replace('build_ahead.build', 'taken.quarter(3)\nbuild_ahead.build')
    with pytest.raises(AssertionError, match='was called in several ways'):
        run(several, built)
