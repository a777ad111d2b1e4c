"""What set-up leaves: an environment that every shell can enter, again and again."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

needs_wheels = pytest.mark.skipif(
    Path('/opt/ros/jazzy/setup.bash').exists(), reason='this machine has ROS 2 Jazzy installed'
)
needs_zsh = pytest.mark.skipif(not shutil.which('zsh'), reason='this machine has no zsh')


@pytest.mark.parametrize('shell', ['bash', pytest.param('zsh', marks=needs_zsh)])
def test_the_environment_is_the_same_in_every_shell_and_when_it_is_entered_again(
    shell: str,
) -> None:
    entered = f'. "{ROOT}/install/environment.bash"'
    asked = 'PATH PYTHONPATH LD_LIBRARY_PATH AMENT_PREFIX_PATH NUMBA_CACHE_DIR ROS_DISTRO'
    said = [
        subprocess.run(
            [*command, f'{entered}; {again}; for name in {asked}; do printenv $name; done'],
            env={'HOME': '/', 'PATH': f'/usr/bin:{ROOT}/.venv/bin:/bin', 'PYTHONPATH': '/mine'},
            capture_output=True,
            text=True,
            check=True,
        )
        for command, again in (
            ([shutil.which(shell) or shell, '-euc'], 'true'),
            (['bash', '-euc'], entered),
        )
    ]
    assert said[0].stdout == said[1].stdout
    assert said[0].stdout.splitlines()[0].startswith(f'{ROOT}/.venv/bin:')
    assert said[0].stdout.splitlines()[1].endswith(':/mine')
    assert [each.stderr for each in said] == ['', '']


def test_another_shell_is_told(tmp_path: Path) -> None:
    dash = shutil.which('dash')
    if dash is None:
        pytest.skip('there is no other shell here')
    result = subprocess.run(
        [dash, '-c', f'. {ROOT}/setup.sh'], capture_output=True, text=True, check=False
    )
    assert result.returncode == 1
    assert 'this is for bash' in result.stderr


def test_once_done_it_costs_nothing_and_changes_no_shell(tmp_path: Path) -> None:
    if not (ROOT / 'install' / '.stamp').exists():
        pytest.skip('this workspace was not set up by setup.sh')
    script = f"""
        cd /
        alias cd=false
        set -u -- one two
        before=$(set -o; shopt)
        . {ROOT}/setup.sh
        [[ $ROS_DISTRO$ROS_VERSION$ROS_PYTHON_VERSION == jazzy23 ]] || echo no ROS
        path=$PATH$PYTHONPATH$LD_LIBRARY_PATH$AMENT_PREFIX_PATH
        . {ROOT}/setup.sh
        [[ $path == "$PATH$PYTHONPATH$LD_LIBRARY_PATH$AMENT_PREFIX_PATH" ]] || echo grows
        [[ $before == "$(set -o; shopt)" ]] || echo options
        [[ "$* $PWD" == 'one two /' ]] || echo moved
        ! declare -F | grep -i maglev
    """
    for tool in ('python3', 'pip', 'colcon', 'cmake', 'make', 'cc'):
        slow = tmp_path / tool
        slow.write_text(f'#!/bin/bash\necho {tool} is called\n')
        slow.chmod(0o755)
    environment = {'HOME': os.environ['HOME'], 'PATH': f'{tmp_path}:{os.environ["PATH"]}'}
    result = subprocess.run(
        ['/bin/bash', '-c', script], env=environment, capture_output=True, text=True, check=False
    )
    assert (result.returncode, result.stdout, result.stderr) == (0, '', '')


@needs_wheels
def test_ros2_is_there_and_never_before_a_real_one(tmp_path: Path) -> None:
    if not (ROOT / 'install' / '.stamp').exists():
        pytest.skip('this workspace was not set up by setup.sh')
    real = tmp_path / 'ros2'
    real.write_text('#!/bin/sh\n')
    real.chmod(0o755)
    script = f"""
        set -eu
        . {ROOT}/setup.sh
        type -P ros2
        complete -p ros2
        PATH=$PATH:{tmp_path}
        . {ROOT}/setup.sh
        type -P ros2
    """
    result = subprocess.run(
        ['/bin/bash', '-c', script],
        env={'HOME': os.environ['HOME'], 'PATH': os.defpath},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (result.returncode, result.stderr) == (0, '')
    ours, completion, found = result.stdout.splitlines()
    assert ours == f'{ROOT}/install/maglev_ros2cli/lib/maglev_ros2cli/ros2'
    assert completion.endswith(' ros2')
    assert found == str(real)
