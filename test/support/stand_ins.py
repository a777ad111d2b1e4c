"""The scenario scripts in a workspace whose nodes and programs are stand-ins."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NODES = ('watchers', 'plant', 'controller', 'reference', 'view')

# A node that runs until it is told to end and writes down when it does. What it does instead is in
# a file named after it, or after it and the folder of the run (watchers@steps): `die`, `stubborn`,
# `warn`, `fail`, or, for the watchers, the verdict `pass` or `miss` once all others are up, or
# `wait` for a file `enough`.
STAND_IN = r"""#!/usr/bin/env bash
name=${0##*/} tree=@TREE@ out='' what=''
for word; do
  [[ $word != *effective_parameters:=* ]] || out=${word#*:=\"} out=${out%/params/*}
done
out=${out//'\"'/\"}
echo "$name $*" >>"$tree/history"
printf '%s\n' "$@" >"$tree/arguments/$name"
for file in "$tree/behaviour/$name@${out##*/}" "$tree/behaviour/$name"; do
  [[ ! -f $file || -n $what ]] || read -r what <"$file" || true
done
ended() { echo "$name" >>"$tree/ended"; exit "$1"; }
trap 'ended 130' INT
trap 'ended 0' TERM
echo $$ >"$tree/pids/$name" # from now on it can be told to end
: >"$tree/up/$name${out//\//-}"
case $what in
  die) sleep 0.3; echo '[INFO] all well' >&2; echo 'error: the belt broke' >&2; exit 3 ;;
  fail) sleep 0.3; echo 'ERROR 1.0 the belt broke' >&2; exit 1 ;;
  stubborn) trap '' INT TERM ;;
  warn)
    for time in 1.0 2.0; do echo "WARN $time the belt slips"; echo "INFO $time all is well"; done
    echo 'ERROR 3.0 the belt: broke'
    printf 'ERROR 4.0 no end' >&2
    ;;
  wait)
    while [[ ! -e $tree/enough ]]; do sleep 0.02; done
    echo '{"verdict": "pass"}' >"$out/metrics.json"
    ;;
  pass | miss)
    while [[ ! -e $out/log/reference.log ]]; do sleep 0.02; done
    sleep 0.3
    for log in "$out"/log/*.log; do
      other=${log##*/} other=${other%.log} other=${other/#stage/plant}
      while [[ ! -e $tree/up/$other${out//\//-} ]]; do sleep 0.02; done
    done
    echo 'INFO 1790000000.1 recording'
    echo 'y 3.0 um'
    echo "{\"verdict\": \"$what\", \"reasons\": [\"too far off\"]}" >"$out/metrics.json"
    ;;
esac
exec 9<> <(:) # a sleep would be ended too, and the shell say so
while :; do read -rt 0.02 -u 9; done
"""

ANALYZE = r"""#!/usr/bin/env bash
echo $$ >"@TREE@/pids/analyze"
[[ $2 == --out && $1 == "$3/bag" ]] || exit 2
while [[ -e @TREE@/behaviour/analyze ]]; do sleep 0.02; done
echo '<html>' >"$3/report.html"
"""

# Any other program: writes down what it is told and ends with the code in its file.
PROGRAM = r"""#!/usr/bin/env bash
echo "${0##*/} $*" >>"@TREE@/history"
exit "$(cat "@TREE@/behaviour/${0##*/}" 2>/dev/null || echo 0)"
"""


class Tree:
    """A copy of the scenarios in a workspace of stand-ins."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.out = path / 'run'
        ignored = shutil.ignore_patterns('__pycache__')
        shutil.copytree(ROOT / 'scenarios', path / 'scenarios', ignore=ignored)
        for name in ('bin', 'pids', 'up', 'arguments', 'behaviour', 'params'):
            (path / name).mkdir()
        self.script(path / 'bin' / 'python3', f'#!/bin/sh\nexec {sys.executable} "$@"\n')
        (path / 'setup.sh').write_text(
            f'export AMENT_PREFIX_PATH=/nowhere:{path}/prefix\n'
            f'export PYTHONPATH={ROOT}/src/maglev_model PYTHONDONTWRITEBYTECODE=1\n'
            f'export PATH={Path(sys.executable).parent}:$PATH\n'
        )
        for name in ('plant', 'scenario_ellipse', 'soft'):
            self.parameters(f'params/{name}.yaml')
        for name in NODES:
            package = 'maglev_monitor' if name == 'watchers' else f'maglev_{name}'
            self.executable(package, name, STAND_IN)
        self.executable('maglev_monitor', 'analyze', ANALYZE)
        self.executable('maglev_view', 'replay', PROGRAM)
        for name in ('paper_tables', 'compare', 'faults', 'robustness', 'tune'):
            self.executable('maglev_study', name, PROGRAM)
        self.executable('maglev_hw_bridge', 'commission', PROGRAM)
        self.behave('watchers', 'pass')

    def parameters(self, name: str, section: str = '/**') -> Path:
        """Write a parameter file that sets nothing."""
        file = self.path / name
        file.write_text(f'{section}:\n  ros__parameters: {{}}\n')
        return file

    def executable(self, package: str, name: str, text: str) -> None:
        """Write one stand-in as ``prefix/lib/package/name``."""
        self.script(self.path / 'prefix' / 'lib' / package / name, text)

    def script(self, file: Path, text: str) -> None:
        """Write an executable file, naming this tree in it."""
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace('@TREE@', str(self.path)))
        file.chmod(0o755)

    def behave(self, node: str, what: str) -> None:
        """Choose what a stand-in does."""
        (self.path / 'behaviour' / node).write_text(what)

    def start(
        self, *options: str, script: str = 'ellipse', path: str = '/usr/bin:/bin'
    ) -> subprocess.Popen[str]:
        """Start a script as a shell would, in a session of its own."""
        return subprocess.Popen(
            [self.path / 'scenarios' / f'{script}.sh', *options],
            cwd=self.path,
            env={**os.environ, 'PATH': f'{self.path}/bin:{path}'},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def finish(self, *options: str, script: str, path: str = '/usr/bin:/bin') -> tuple[int, str]:
        """Run a script and return its exit code and output."""
        process = self.start(*options, script=script, path=path)
        output, _ = process.communicate(timeout=30)
        return process.returncode, output

    def run(self, *options: str) -> tuple[int, str]:
        """Run the ellipse into ``out``."""
        return self.finish('--out', str(self.out), *options, script='ellipse')

    def started(self) -> list[str]:
        """The stand-ins that have come up."""
        return [file.name for file in (self.path / 'pids').iterdir() if file.read_text().strip()]

    def wait_started(self, *names: str) -> None:
        """Wait until these are up, or all nodes."""
        deadline = time.monotonic() + 30.0
        while not set(names or NODES) <= set(self.started()):
            assert time.monotonic() < deadline, self.started()
            time.sleep(0.02)

    def alive(self) -> list[str]:
        """The stand-ins that still run."""
        found = []
        for name in self.started():
            status = Path('/proc', (self.path / 'pids' / name).read_text().strip(), 'status')
            if status.exists() and 'State:\tZ' not in status.read_text():
                found.append(name)
        return found

    def wait_gone(self) -> None:
        """Wait until no stand-in runs."""
        deadline = time.monotonic() + 20.0
        while self.alive():
            assert time.monotonic() < deadline, self.alive()
            time.sleep(0.02)

    def ended(self) -> list[str]:
        """The stand-ins that were told to end, in that order."""
        return (self.path / 'ended').read_text().split()

    def arguments(self, node: str) -> list[str]:
        """The arguments a stand-in was given, the last time."""
        return (self.path / 'arguments' / node).read_text().splitlines()

    def files(self, node: str) -> list[str]:
        """The parameter files a stand-in was given, within this tree."""
        words = self.arguments(node)
        chosen = [words[i + 1] for i, word in enumerate(words) if word == '--params-file']
        return [str(Path(file).relative_to(self.path)) for file in chosen]

    def history(self, name: str) -> list[str]:
        """What a stand-in was told, each time."""
        path = self.path / 'history'
        lines = path.read_text().splitlines() if path.exists() else []
        return [line.removeprefix(f'{name} ') for line in lines if line.startswith(f'{name} ')]

    def kill_all(self) -> None:
        """Let nothing outlive a test."""
        for name in self.alive():
            os.kill(int((self.path / 'pids' / name).read_text()), signal.SIGKILL)
