"""In a virtual environment without ROS: pip installs the packages, six lines fly the ellipse."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from source_tree import PURE, ROOT

LIBRARIES = ('numpy', 'scipy', 'numba', 'llvmlite', 'yaml', 'setuptools', '_distutils_hack')
"""What is borrowed from this environment, so that the test needs no network: no ROS."""

SIX_LINES = """
from maglev_study.flight import fly

flight = fly('ellipse', duration=20.0)
for axis, error in flight.mean_error.items():
    print(f'{axis}: {1e6 * error:.2f}')
"""

NO_ROS = """
import re
import sys


class NoRos:
    def find_spec(self, name, path=None, target=None):
        if re.match(r'rclpy|rosidl|ament|maglev_node|\\w+_(msgs|srvs|interfaces)\\b', name):
            raise AssertionError(f'{name} is imported')


sys.meta_path.insert(0, NoRos())
"""


@pytest.fixture(scope='module')
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of an environment that has the libraries, and nothing else."""
    folder = tmp_path_factory.mktemp('venv')
    subprocess.run(
        [sys.executable, '-m', 'venv', '--without-pip', folder / 'venv'], check=True, timeout=60
    )
    libraries = folder / 'libraries'
    libraries.mkdir()
    for name in LIBRARIES:
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert spec.origin is not None
        source = Path(spec.origin).parent
        for path in (source, *source.parent.glob(f'{name}-*.dist-info')):
            (libraries / path.name).symlink_to(path)
    (site,) = (folder / 'venv').glob('lib/python*/site-packages')
    (site / 'libraries.pth').write_text(f'{libraries}\n')
    return folder / 'venv' / 'bin' / 'python'


def run(arguments: list[object], folder: Path, timeout: float) -> subprocess.CompletedProcess[str]:
    """Run a command that inherits nothing of this environment's paths."""
    return subprocess.run(
        [str(argument) for argument in arguments],
        cwd=folder,
        env={'HOME': str(folder), 'PATH': os.defpath, 'TMPDIR': str(folder)},
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


@pytest.mark.long
def test_pip_installs_the_packages_and_six_lines_fly_the_ellipse(
    python: Path, tmp_path: Path
) -> None:
    for package in PURE:
        shutil.copytree(
            ROOT / 'src' / package,
            tmp_path / package,
            symlinks=True,
            ignore=shutil.ignore_patterns('__pycache__', '*.egg-info', 'build'),
        )
    pip = [sys.executable, '-I', '-m', 'pip', '--python', python, '--isolated', 'install']
    offline = ['--no-index', '--no-deps', '--no-build-isolation', '--no-compile', '--quiet']
    offline.append('--use-pep517')  # which an older pip does not take by itself
    folders = [tmp_path / package for package in PURE]
    installed = run([*pip, *offline, *folders], tmp_path, 300.0)
    assert installed.returncode == 0, installed.stderr
    flown = run([python, '-c', NO_ROS + SIX_LINES], tmp_path, 300.0)
    assert flown.returncode == 0, flown.stderr
    assert re.fullmatch(
        r'y: 1\.[23]\d\nx: 1\.[23]\d\nz: 1\.[23]\d\nphi: 0\.00\ntheta: 0\.00\n', flown.stdout
    )


def test_the_readme_shows_these_lines() -> None:
    assert SIX_LINES.strip() in (ROOT / 'README.md').read_text(encoding='utf-8')


def test_the_hook_would_see_ros(python: Path, tmp_path: Path) -> None:
    for name in ('rclpy', 'std_msgs.msg', 'maglev_msgs', 'rcl_interfaces'):
        told = run([python, '-c', f'{NO_ROS}import {name}'], tmp_path, 60.0)
        assert told.returncode == 1
        assert f'{name.partition(".")[0]} is imported' in told.stderr
