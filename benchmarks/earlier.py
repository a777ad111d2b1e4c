"""The closed loop as it was at an earlier commit, in a process of its own, for paired runs."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import tarfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
_LOOP = """
import sys
from closed_loop import ControllerParameters, compiled_loop, ellipse, warm_up
warm_up()
references = ellipse(int(sys.argv[1]), ControllerParameters().sample_time)
compiled_loop(references)
for _ in sys.stdin:
    print(compiled_loop(references)[0], flush=True)
"""


class EarlierLoop:
    """Its own packages and the loop of its own benchmark, unpacked into a folder.

    Raises OSError where this clone has no such commit.
    """

    def __init__(self, commit: str, folder: Path, samples: int) -> None:
        command = ['git', '-C', str(ROOT), 'archive', commit, 'src', 'benchmarks', 'params']
        archive = subprocess.run(command, capture_output=True, check=False)
        if archive.returncode:
            raise OSError(archive.stderr.decode().strip())
        with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
            files.extractall(folder, filter='data')
        packages = os.pathsep.join(map(str, (folder / 'src').iterdir()))
        environment = {**os.environ, 'PYTHONPATH': packages, 'NUMBA_CACHE_DIR': str(folder)}
        self._process = subprocess.Popen(
            [sys.executable, '-c', _LOOP, str(samples)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=folder / 'benchmarks',
            env=environment,
        )

    def seconds(self) -> float:
        """How long one run takes [s]; the first waits until all is compiled."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(file=self._process.stdin, flush=True)
        return float(self._process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        self._process.communicate()
