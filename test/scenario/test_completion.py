"""What bash and zsh offer behind the scripts: their options, the values of these, files."""

from __future__ import annotations

import os
import pty
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

OFFER = """
. "$0/scenarios/complete.bash"
complete -p "${1##*/}" >/dev/null || echo none
COMP_CWORD=$(($# - 1)) COMPREPLY=()
_complete_scenario "$1" "${@: -1}" "${@: -2:1}"
printf '%s\n' "${COMPREPLY[@]}"
"""


def offered(*words: str, folder: Path = ROOT) -> set[str]:
    """What is offered for the last of some words."""
    command = ['bash', '-uc', OFFER, str(ROOT), *words]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert result.stderr == ''
    return set(result.stdout.split())


@pytest.mark.parametrize('path', sorted(ROOT.glob('scenarios/*.sh')), ids=lambda path: path.name)
def test_every_script_offers_its_options(path: Path) -> None:
    assert '--help' in offered(str(path), '--')


def test_values() -> None:
    assert offered('./scenarios/ellipse.sh', '--stage', '') == {'plant', 'hw_bridge'}
    assert offered('./scenarios/steps.sh', '--mode', 'real') == {'realtime'}
    assert offered('./scenarios/compare.sh', '--laws', 'regu') == {'regulator_3dof'}
    assert offered('./scenarios/ellipse.sh', '--duration', '') == set()


def test_options_with_a_dash_within() -> None:
    assert offered('./scenarios/ellipse.sh', '--no') == {'--no-view'}


@pytest.mark.skipif(not shutil.which('zsh'), reason='this machine has no zsh')
def test_zsh_completes_as_bash_does(tmp_path: Path) -> None:
    (tmp_path / '.zshrc').write_text(
        f"PS1='ready> '\nautoload -Uz compinit && compinit -u -d {tmp_path}/dump\n"
        'autoload -U +X bashcompinit && bashcompinit\n'
        f'. {ROOT}/scenarios/complete.bash\n'
    )
    terminal, other = pty.openpty()
    zsh = subprocess.Popen(
        ['zsh', '-i'],
        cwd=ROOT,
        env={**os.environ, 'ZDOTDIR': str(tmp_path), 'TERM': 'xterm'},
        stdin=other,
        stdout=other,
        stderr=other,
        start_new_session=True,
    )
    try:
        for typed, shown in (('', 'ready> '), ('./scenarios/ellipse.sh --no\t', '--no-view')):
            os.write(terminal, typed.encode())
            deadline, seen = time.monotonic() + 20.0, ''
            while shown not in seen:
                assert time.monotonic() < deadline, seen
                if select.select([terminal], [], [], 0.1)[0]:
                    seen += os.read(terminal, 4096).decode(errors='replace')
    finally:
        zsh.kill()
        zsh.wait()
        os.close(terminal)
        os.close(other)


def test_trajectories_come_first() -> None:
    assert offered('./scenarios/trajectory.sh', 'ci') == {'circle'}
    assert offered('./scenarios/trajectory.sh', 'circle', 'ci') == set()


def test_overlays_are_those_of_params_and_of_the_folder(tmp_path: Path) -> None:
    (tmp_path / 'pale.yaml').touch()
    (tmp_path / 'pale.txt').touch()
    (tmp_path / 'palest').mkdir()
    script = str(ROOT / 'scenarios' / 'ellipse.sh')
    found = offered(script, '--params', 'pa', folder=tmp_path)
    assert {'pale.yaml', 'palest/', 'paper.yaml'} <= found
    assert 'pale.txt' not in found


def test_scripts_of_others_by_the_same_names_are_left_to_them(tmp_path: Path) -> None:
    assert offered(str(tmp_path / 'compare.sh'), '--') == set()
    assert offered('compare.sh', '--') == set()
