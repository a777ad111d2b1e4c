"""``scenarios/paper_tables.sh``: which runs it makes, how it ends. Scenarios are stand-ins here."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# A scenario that writes down what it is told; `fail` and `hang` are the names of those that do.
STAND_IN = r"""#!/usr/bin/env bash
tree=@TREE@ out=${*: -1}
name=${out#"$tree/out/"}
printf '%s %s\n' "$name" "$*" >>"$tree/runs"
trap 'sleep 0.3; echo "$name INT" >>"$tree/ended"; exit 130' INT
trap 'sleep 0.3; echo "$name TERM" >>"$tree/ended"; exit 143' TERM
[[ $name == "$(cat "$tree/fail" 2>/dev/null)" ]] && exit 1
if [[ $name == "$(cat "$tree/hang" 2>/dev/null)" ]]; then
  echo ready >"$tree/ready"
  while :; do sleep 0.02; done
fi
exit 0
"""

PAGE = r"""#!/usr/bin/env bash
echo "page $*" >>@TREE@/runs
exit "$(cat @TREE@/page-code 2>/dev/null || echo 0)"
"""


class Tree:
    """A copy of the script in a workspace of stand-ins."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.out = path / 'out'
        (path / 'scenarios').mkdir()
        for name in ('lib', 'paper_tables'):
            shutil.copy(ROOT / 'scenarios' / f'{name}.sh', path / 'scenarios')
        for name in ('steps', 'ellipse', 'ellipse_4dof'):
            self.script(path / 'scenarios' / f'{name}.sh', STAND_IN)
        (path / 'setup.sh').write_text(f'export AMENT_PREFIX_PATH={path}/prefix\n')
        self.script(path / 'prefix' / 'lib' / 'maglev_monitor' / 'paper_tables', PAGE)

    def script(self, file: Path, text: str) -> None:
        """Write an executable file, naming this tree in it."""
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace('@TREE@', str(self.path)))
        file.chmod(0o755)

    def start(self, *options: str) -> subprocess.Popen[str]:
        """Start the script as a shell would, in a session of its own."""
        return subprocess.Popen(
            [self.path / 'scenarios' / 'paper_tables.sh', *options],
            cwd=self.path,
            env={**os.environ, 'PATH': '/usr/bin:/bin'},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def run(self, *options: str) -> tuple[int, str]:
        """Run the script and return its exit code and output."""
        process = self.start('--out', str(self.out), *options)
        output, _ = process.communicate(timeout=30)
        return process.returncode, output

    def lines(self, name: str) -> list[str]:
        """Lines of a file that stand-ins write."""
        path = self.path / name
        return path.read_text().splitlines() if path.exists() else []


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    return Tree(tmp_path)


def test_all_runs_then_the_page(tree: Tree) -> None:
    code, output = tree.run('--mode=realtime')
    assert (code, output.splitlines()[-1]) == (0, 'paper_tables: passed')
    *runs, page = tree.lines('runs')
    assert [run.split()[0] for run in runs] == [
        f'{controller}/{scenario}'
        for controller in ('paper', 'ours')
        for scenario in ('steps', 'ellipse', 'ellipse_4dof')
    ]
    for run in runs:
        assert '--mode realtime' in run
        assert '/benchmark.yaml ' in run
        assert '--duration' not in run
        files = [word.rsplit('/', 1)[-1] for word in run.split() if word.endswith('.yaml')]
        law = ['paper.yaml', 'paper_exact.yaml'] if run.startswith('paper/') else []
        assert files == ['benchmark.yaml', *law]
    assert page == f'page {tree.out}'


def test_quick_runs_are_short(tree: Tree) -> None:
    assert tree.run('--quick')[0] == 0
    for run in tree.lines('runs')[:-1]:
        assert f'--duration {6.0 if "/steps " in run else 4.0} ' in run


def test_a_run_that_fails_does_not_stop_the_others(tree: Tree) -> None:
    (tree.path / 'fail').write_text('paper/ellipse')
    code, output = tree.run()
    assert code == 1
    assert output.splitlines()[-1] == 'paper_tables: FAILED: paper/ellipse'
    assert len(tree.lines('runs')) == 7


def test_a_page_that_fails_fails(tree: Tree) -> None:
    (tree.path / 'page-code').write_text('2')
    code, output = tree.run()
    assert (code, output.splitlines()[-1]) == (1, 'paper_tables: FAILED')


@pytest.mark.parametrize(
    ('number', 'code', 'name'), [(signal.SIGINT, 130, 'INT'), (signal.SIGTERM, 143, 'TERM')]
)
def test_a_signal_ends_the_run_in_progress_and_no_other_begins(
    tree: Tree, number: signal.Signals, code: int, name: str
) -> None:
    (tree.path / 'hang').write_text('paper/ellipse')
    process = tree.start('--out', str(tree.out))
    deadline = time.monotonic() + 10.0
    while not tree.lines('ready') and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(number)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == code
    assert tree.lines('ended') == [f'paper/ellipse {name}'], 'it did not wait for the clean-up'
    assert [run.split()[0] for run in tree.lines('runs')] == ['paper/steps', 'paper/ellipse']
    assert 'interrupted' in output.splitlines()[-1]


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--mode', 'fast'], "--mode is 'fast', it must be one of: lockstep realtime"),
        (['--duration', '3'], "unknown option '--duration'"),
        (['--out='], '--out needs a folder'),
        (['--mode'], '--mode needs a value'),
        (['--out', '/proc/nothing'], "cannot write to '/proc/nothing'"),
    ],
)
def test_wrong_use_is_one_line(tree: Tree, options: list[str], words: str) -> None:
    code, output = tree.run(*options)
    assert code == 2
    assert output.startswith('paper_tables: error: ')
    assert words in output
    assert output.count('\n') == 1
    assert not tree.lines('runs')


def test_a_folder_with_runs_is_refused(tree: Tree) -> None:
    (tree.out / 'ours').mkdir(parents=True)
    code, output = tree.run()
    assert code == 2
    assert 'already holds runs' in output
    assert not tree.lines('runs')


def test_help_names_every_option(tree: Tree) -> None:
    code, output = tree.run('--help')
    assert code == 0
    for option in ('--mode', '--out', '--quick', '--help'):
        assert option in output
    assert not tree.out.exists()
