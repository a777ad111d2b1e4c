"""Who calls a script, and from what shell, makes no difference."""

from __future__ import annotations

import os
import subprocess

import pytest
from stand_ins import Tree


def called(tree: Tree, command: str, **variables: str) -> tuple[int, str]:
    """Exit code and output of a line of shell in which ``$0`` is the script of the ellipse."""
    result = subprocess.run(
        ['bash', '-c', command, tree.path / 'scenarios' / 'ellipse.sh', '--out', tree.out],
        cwd=tree.path,
        env={**os.environ, 'PATH': f'{tree.path}/bin:/usr/bin:/bin', **variables},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=60,
        check=False,
    )
    return result.returncode, result.stdout


@pytest.mark.parametrize(
    'command',
    [
        'sh "$0" "$@"',
        'bash scenarios/ellipse.sh "$@"',
        'cd /; "$0" "$@"',
        'ln -s "$0" fly; ./fly "$@"',
        'ln -s scenarios "of mine"; "./of mine/ellipse.sh" "$@"',
        'cd() { builtin cd "$@" && ls; }; dirname() { echo no; }; export -f cd dirname; "$0" "$@"',
        'set -eu; set -o posix; export SHELLOPTS CDPATH=/; "$0" "$@"',
    ],
)
def test_however_it_is_called_it_flies(tree: Tree, command: str) -> None:
    code, output = called(tree, command)
    assert code == 0, output
    assert output.startswith('ellipse: plant, lockstep, into ')


def test_the_shells_own_start_up_file_is_left(tree: Tree) -> None:
    (tree.path / 'start-up').write_text('echo noise; exit 3\n')
    code, output = called(tree, 'BASH_ENV=start-up "$0" --help')
    assert code == 0, output
    assert 'noise' not in output


@pytest.mark.parametrize('closed', ['<&-', '>&-', '2>&-', '<&- >&- 2>&-'])
def test_nothing_need_be_open(tree: Tree, closed: str) -> None:
    code, output = called(tree, f'"$0" "$@" {closed}')
    assert code == 0, output
    assert 'Error' not in output
    assert (tree.out / 'report.html').exists()


def test_what_the_callers_python_finds_and_does_is_no_matter(tree: Tree) -> None:
    packages = tree.path / '.venv' / 'lib' / 'python3.12' / 'site-packages'
    packages.mkdir(parents=True)
    told = '#!/bin/sh\necho "$PYTHONPATH" "${PYTHONWARNINGS-none}" "${PYTHONINSPECT-none}"\n'
    tree.executable('maglev_study', 'compare', told)
    with (tree.path / 'setup.sh').open('a') as setup:
        setup.write(
            'export PYTHONPATH=$PYTHONPATH:/of/the/caller PYTHONWARNINGS=error PYTHONINSPECT=1\n'
        )
    code, output = tree.finish(script='compare')
    assert code == 0
    assert output.startswith(f'{packages}:')
    assert output.endswith(':/of/the/caller none none\n')


def test_a_terminal_of_another_encoding_stops_no_node(tree: Tree) -> None:
    tree.executable('maglev_study', 'compare', "#!/usr/bin/env python3\nprint('\\u00b5m')\n")
    told = 'PYTHONUTF8=0 PYTHONIOENCODING=ascii "${0%/*}/compare.sh"'
    assert called(tree, told, LC_ALL='C') == (0, 'µm\n')


@pytest.mark.parametrize(('only', 'told'), [('1', 'LOCALHOST none none'), ('0', 'SUBNET a;b none')])
def test_what_ros_wants_otherwise_today_is_told_so(tree: Tree, only: str, told: str) -> None:
    names = ('AUTOMATIC_DISCOVERY_RANGE', 'STATIC_PEERS', 'LOCALHOST_ONLY')
    said = ' '.join(f'"${{ROS_{name}-none}}"' for name in names)
    tree.executable('maglev_study', 'compare', f'#!/bin/sh\necho {said}\n')
    given = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET', 'ROS_STATIC_PEERS': 'a;b'}
    code, output = called(tree, '"${0%/*}/compare.sh"', ROS_LOCALHOST_ONLY=only, **given)
    assert (code, output) == (0, f'{told}\n')
