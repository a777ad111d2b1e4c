"""A machine of our choice, on which setup.sh is tried."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

TOOLS = (
    *('awk', 'bash', 'basename', 'cat', 'cut', 'date', 'df', 'dirname', 'env', 'find', 'flock'),
    *('grep', 'head', 'ls', 'mkdir', 'mv', 'rm', 'sed', 'sha256sum', 'sort', 'tail', 'touch', 'tr'),
    *('true', 'uname', 'wc', 'getconf', 'xargs', 'readlink', 'setpriv'),
)


class Machine:
    """A clone on a machine of our choice: its PATH holds the tools it is given and no others."""

    def __init__(self, path: Path) -> None:
        self.root = path / 'clone'
        self.bin = path / 'bin'
        self.bin.mkdir()
        self.root.mkdir()
        shutil.copy(ROOT / 'setup.sh', self.root)
        shutil.copytree(ROOT / 'setup', self.root / 'setup')
        shutil.copytree(ROOT / 'src' / 'maglev_msgs', self.root / 'src' / 'maglev_msgs')
        for tool in (*TOOLS, 'cmake', 'make', 'cc', 'c++'):
            self.tool(tool)
        self.script('python3', f'exec {sys.executable} "$@"')

    def tool(self, name: str) -> None:
        """Give the machine a tool that this one has, or one that does nothing."""
        found = shutil.which(name, path='/usr/bin:/bin')
        if found:
            (self.bin / name).symlink_to(found)
        else:
            self.script(name, '')

    def script(self, name: str, text: str) -> None:
        """Give the machine a tool of our own."""
        (self.bin / name).unlink(missing_ok=True)
        (self.bin / name).write_text(f'#!/bin/bash\n{text}\n')
        (self.bin / name).chmod(0o755)

    def python(self, lie: str) -> None:
        """Give the machine a Python that believes ``lie``, some code run before its script."""
        self.script(
            'python3',
            f'exec {sys.executable} -c "import sys, runpy; {lie};'
            ' sys.argv = sys.argv[1:]; runpy.run_path(sys.argv[0], run_name=\'__main__\')" "$@"',
        )

    def setup(
        self, shell: str = 'bash', first: str = '', **variables: str
    ) -> tuple[int, list[str]]:
        """Source setup.sh, ``first`` what is in the shell; the exit code and the lines it says."""
        script = f'{first}\nset -eu; . "$0"'
        result = subprocess.run(
            [shutil.which(shell) or shell, '-c', script, self.root / 'setup.sh'],
            env={'HOME': str(self.root), 'PATH': str(self.bin), **variables},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert result.stdout == ''
        return result.returncode, result.stderr.splitlines()

    def refusal(self, first: str = '', **variables: str) -> str:
        """The one line with which setup.sh ends before it has made anything."""
        code, lines = self.setup(first=first, **variables)
        assert code == 1, lines
        assert len(lines) == 1, lines
        assert not (self.root / '.venv').exists()
        assert not (self.root / 'install').exists()
        return lines[0]


needs_wheels = pytest.mark.skipif(
    Path('/opt/ros/jazzy/setup.bash').exists(), reason='this machine has ROS 2 Jazzy installed'
)
