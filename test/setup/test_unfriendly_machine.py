"""setup.sh where others were at work, or shell and pip are set for something else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from bare_machine import ROOT, Machine, needs_wheels


@needs_wheels
@pytest.mark.parametrize(
    'first',
    [
        'cd() { builtin cd "$@" && ls; }; mkdir() { false; }; export -f cd mkdir',
        'export CDPATH=/ POSIXLY_CORRECT=1 GREP_OPTIONS=--color=always; set -a',
        'export BASH_ENV=$HOME/start-up; echo "echo noise >&2; exit 3" >"$BASH_ENV"',
        'export PYTHONPATH=$HOME PYTHONWARNINGS=error; echo "exit()" >"$HOME/platform.py"',
    ],
)
def test_a_shell_set_for_something_else(machine: Machine, first: str) -> None:
    (machine.bin / 'make').unlink()
    assert 'missing: make' in machine.refusal(first)


@needs_wheels
def test_through_a_link(machine: Machine, tmp_path: Path) -> None:
    (machine.bin / 'make').unlink()
    (tmp_path / 'links').mkdir()
    link = tmp_path / 'links' / 'setup.sh'
    link.symlink_to(machine.root / 'setup.sh')
    machine.root = link.parent
    assert 'missing: make' in machine.refusal()


@needs_wheels
@pytest.mark.parametrize('place', ['.venv', '.cache', 'build', 'install'])
def test_what_another_user_has_made(machine: Machine, place: str) -> None:
    """As after a first run by sudo."""
    (machine.root / place).mkdir(mode=0o500)
    helpless = 'setpriv --bounding-set=-all --inh-caps=-all'  # also for root
    script = f'exec {helpless} bash -c \'. "$0"\' "$0"' if os.geteuid() == 0 else ''
    code, lines = machine.setup(first=script)
    assert code == 1
    said = f'setup: cannot write to {machine.root}/{place}: make it writable, or clone elsewhere'
    assert lines == [said]


@needs_wheels
def test_a_lock_that_cannot_be_taken(machine: Machine) -> None:
    (machine.root / '.cache' / 'setup.lock').mkdir(parents=True)
    assert f'cannot write to {machine.root}/.cache/setup.lock' in machine.refusal()


@needs_wheels
def test_with_a_new_venv_all_that_stands_on_it_is_made_anew(machine: Machine) -> None:
    """It may be of another Python."""
    places = ('build', 'install', '.cache/test-tools', '.cache/numba/1a2b')
    stamps = [machine.root / place / '.stamp' for place in places]
    for stamp in stamps:
        stamp.parent.mkdir(parents=True)
        stamp.touch()
    machine.tool('sleep')
    machine.python("sys.executable = '/bin/false'")
    code, lines = machine.setup()
    assert code == 1
    assert 'making .venv' in lines[-1]
    assert not any(stamp.exists() for stamp in stamps)


@needs_wheels
def test_killed_while_it_removes_a_venv_the_next_run_goes_on(machine: Machine) -> None:
    venv = machine.root / '.venv'
    (venv / 'lib' / 'python3.12').mkdir(parents=True)
    (venv / '.made-by-setup').touch()
    machine.script(
        'rm',
        'for word; do [[ ! -e $word/.made-by-setup ]] || mark=$word/.made-by-setup; done\n'
        '[[ -z ${mark:-} ]] || { /bin/rm "$mark"; kill -KILL $PPID; exit 1; }\n'
        'exec /bin/rm "$@"',
    )
    assert machine.setup()[0] != 0
    machine.script('rm', 'exec /bin/rm "$@"')
    (machine.bin / 'make').unlink()
    code, lines = machine.setup()
    assert code == 1
    assert 'missing: make' in lines[-1]


def in_steps(script: str, **variables: str) -> tuple[int, str]:
    """Exit code and output of a script with the steps of the set-up, on this workspace."""
    if not (ROOT / '.venv' / 'bin' / 'python').exists():
        pytest.skip('this workspace was not set up by setup.sh')
    places = f'root={ROOT} venv={ROOT}/.venv cache={ROOT}/.cache branch=wheels'
    done = subprocess.run(
        ['bash', '-euc', f'{places}; . {ROOT}/setup/steps.bash; {script}'],
        env={**os.environ, **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout


def test_colcon_builds_as_it_is_told_here_alone(tmp_path: Path) -> None:
    (tmp_path / '.colcon').mkdir()
    (tmp_path / '.colcon' / 'defaults.yaml').write_text('list:\n  names-only: true\n')
    script = """in_underlay "$venv/bin/python" -c 'from colcon_core.command import main; main()' \\
      list --base-paths "$root/setup/tf2_msgs\""""
    code, said = in_steps(script, HOME=str(tmp_path))
    assert (code, said.split('\t')[0]) == (0, 'tf2_msgs'), said


@pytest.mark.parametrize(
    'conf', ['user = true', 'target = /t\nprefix = /p', 'requirement = /none', 'python = /none']
)
def test_pip_fills_the_environment_whatever_the_users_own_pip_does(
    tmp_path: Path, conf: str
) -> None:
    (tmp_path / 'pip.conf').write_text(f'[install]\n{conf}\n')
    code, said = in_steps(
        'pip_install --dry-run --no-index pip', PIP_CONFIG_FILE=str(tmp_path / 'pip.conf')
    )
    assert code == 0, said
    assert 'already satisfied: pip in ' in said  # and so nothing is to be put elsewhere


def test_of_the_users_pip_its_way_to_packages_is_kept(tmp_path: Path) -> None:
    (tmp_path / 'pip.conf').write_text(
        '[global]\nindex-url = http://a/\nproxy = http://p:1\ntarget = /t\nquiet = 3\n'
        '[install]\nindex-url = http://b/\nextra-index-url =\n  http://c/\n  http://d/\n'
        '[download]\nindex-url = http://e/\n'
    )
    variables = {'PIP_PROXY': 'http://q:2', 'PIP_USER': '1'}
    said = subprocess.run(
        [sys.executable, ROOT / 'setup' / 'pip_settings.py'],
        env={'PIP_CONFIG_FILE': str(tmp_path / 'pip.conf'), **variables},
        capture_output=True,
        text=True,
        check=True,
    )
    settings = dict(one.split('=', 1) for one in said.stdout.split('\0')[:-1])
    assert settings.pop('PIP_EXTRA_INDEX_URL').split() == ['http://c/', 'http://d/']
    assert settings.items() >= {'PIP_INDEX_URL': 'http://b/', 'PIP_PROXY': 'http://q:2'}.items()
    assert not {'PIP_TARGET', 'PIP_USER', 'PIP_QUIET'} & set(settings)
