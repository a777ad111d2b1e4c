"""The scenarios' own shell: options, the nodes' lives and ends. The nodes here are stand-ins."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NODES = ('recorder', 'monitor', 'plant', 'controller', 'reference')

# A node that runs until it is told to end and writes down when it does. What it does instead is in
# a file named after it: `die`, `stubborn`, or, for the monitor, the exit code it ends with.
STAND_IN = r"""#!/usr/bin/env bash
name=${0##*/} tree=@TREE@
echo $$ >"$tree/pids/$name"
printf '%s\n' "$@" >"$tree/arguments/$name"
ended() { echo "$name" >>"$tree/ended"; exit "$1"; }
trap 'ended 130' INT
trap 'ended 143' TERM
what=$(cat "$tree/behaviour/$name" 2>/dev/null)
case $what in
  die) sleep 0.3; echo '[INFO] all well' >&2; echo 'error: the belt broke' >&2; exit 3 ;;
  stubborn) trap '' INT TERM ;;
  [0-9]) sleep 0.5; echo 'y 3.0 um'; echo '{}' >@OUT@/metrics.json; exit "$what" ;;
esac
while :; do sleep 0.02; done
"""

ANALYZE = r"""#!/usr/bin/env bash
[[ $2 == --out && $1 == "$3/bag" ]] || exit 2
echo '<html>' >"$3/report.html"
"""

# As the real one: waits for its child, also through Ctrl-C, which the child has seen as well.
ROS2 = r"""#!/usr/bin/env python3
import subprocess
import sys

assert sys.argv[1:3] == ['run', '--prefix'], sys.argv
package, executable = sys.argv[4:6]
with open('@TREE@/ros2', 'a') as file:
    print(*sys.argv[4:], file=file)
path = f'@TREE@/prefix/lib/{package}/{executable}'
process = subprocess.Popen([*sys.argv[3].split(), path, *sys.argv[6:]])
while process.returncode is None:
    try:
        process.communicate()
    except KeyboardInterrupt:
        pass
sys.exit(process.returncode)
"""


class Tree:
    """A copy of the scenarios in a workspace of stand-ins."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.out = path / 'run'
        shutil.copytree(ROOT / 'scenarios', path / 'scenarios')
        for name in ('pids', 'arguments', 'behaviour', 'params'):
            (path / name).mkdir()
        (path / 'setup.sh').write_text(f'export AMENT_PREFIX_PATH=/nowhere:{path}/prefix\n')
        for name in ('plant', 'scenario_ellipse', 'soft'):
            (path / 'params' / f'{name}.yaml').write_text('/**:\n  ros__parameters: {}\n')
        for name in NODES:
            package = 'maglev_monitor' if name == 'recorder' else f'maglev_{name}'
            self.executable(package, name, STAND_IN)
        self.executable('maglev_monitor', 'analyze', ANALYZE)
        self.behave('monitor', '0')

    def executable(self, package: str, name: str, text: str) -> None:
        """Write one stand-in as ``prefix/lib/package/name``."""
        self.script(self.path / 'prefix' / 'lib' / package / name, text)

    def script(self, file: Path, text: str) -> None:
        """Write an executable file, naming this tree in it."""
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text.replace('@TREE@', str(self.path)).replace('@OUT@', str(self.out)))
        file.chmod(0o755)

    def behave(self, node: str, what: str) -> None:
        """Choose what a stand-in does."""
        (self.path / 'behaviour' / node).write_text(what)

    def start(self, *options: str, path: str = '') -> subprocess.Popen[str]:
        """Start the ellipse as a shell would, in a session of its own."""
        return subprocess.Popen(
            [self.path / 'scenarios' / 'ellipse.sh', *options],
            cwd=self.path,
            env={**os.environ, 'PATH': path + '/usr/bin:/bin'},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def run(self, *options: str, path: str = '') -> tuple[int, str]:
        """Run the ellipse and return its exit code and output."""
        process = self.start('--out', str(self.out), *options, path=path)
        output, _ = process.communicate(timeout=30)
        return process.returncode, output

    def started(self) -> list[str]:
        """The stand-ins that have come up."""
        return [file.name for file in (self.path / 'pids').iterdir() if file.read_text().strip()]

    def wait_started(self) -> None:
        """Wait until all five are up."""
        deadline = time.monotonic() + 10.0
        while len(self.started()) < len(NODES):
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

    def ended(self) -> list[str]:
        """The stand-ins that were told to end, in that order."""
        return (self.path / 'ended').read_text().split()

    def arguments(self, node: str) -> list[str]:
        """The arguments a stand-in was given."""
        return (self.path / 'arguments' / node).read_text().splitlines()


@pytest.fixture
def tree(tmp_path: Path) -> Iterator[Tree]:
    made = Tree(tmp_path)
    yield made
    for name in made.alive():
        os.kill(int((tmp_path / 'pids' / name).read_text()), signal.SIGKILL)


def test_a_run_that_passes(tree: Tree) -> None:
    code, output = tree.run()
    assert code == 0, output
    assert 'y 3.0 um' in output  # what the monitor says is seen
    assert 'ellipse: passed' in output
    for name in ('report.html', 'metrics.json', 'log'):
        assert f'{tree.out}/{name}' in output
    assert tree.ended() == ['reference', 'controller', 'plant', 'recorder']
    assert tree.alive() == []


def test_the_nodes_get_their_parameters(tree: Tree) -> None:
    soft = tree.path / 'mine.yaml'
    soft.write_text('controller:\n  ros__parameters: {}\n')
    options = ('--mode', 'realtime', '--duration=3', '--params', 'soft', '--params', 'mine.yaml')
    code, output = tree.run(*options)
    assert code == 0, output
    params = tree.path / 'params'
    plant = tree.arguments('plant')
    files = [plant[i + 1] for i, word in enumerate(plant) if word == '--params-file']
    assert files == [
        str(file)
        for file in (
            params / 'plant.yaml',
            params / 'scenario_ellipse.yaml',
            params / 'soft.yaml',
            soft,
        )
    ]
    assert {'mode:=realtime', 'watchers:=2'} <= set(plant)
    assert f'effective_parameters:={tree.out}/params/plant.yaml' in plant
    reference = tree.arguments('reference')
    assert {'duration:=3.0', 'autostart:=true', 'watchers:=2'} <= set(reference)
    monitor = tree.arguments('monitor')
    assert {f'output:={tree.out}/metrics.json', 'scenario:=ellipse', 'stage:=plant'} <= set(monitor)
    assert f'output:={tree.out}/bag' in tree.arguments('recorder')


def test_a_run_outside_its_limits_still_has_its_report(tree: Tree) -> None:
    tree.behave('monitor', '1')
    code, output = tree.run()
    assert code == 1
    assert 'FAILED' in output
    assert (tree.out / 'report.html').exists()


@pytest.mark.parametrize('node', ['plant', 'controller', 'reference', 'recorder', 'monitor'])
def test_a_node_that_dies_ends_the_run(tree: Tree, node: str) -> None:
    tree.behave('monitor', 'run')
    tree.behave(node, 'die')
    code, output = tree.run()
    assert code == 1
    name = 'stage' if node == 'plant' else node
    assert f'{name} ended early with exit code 3: error: the belt broke' in output
    assert f'{tree.out}/log/{name}.log' in output
    assert tree.alive() == []


def test_a_node_that_cannot_be_executed(tree: Tree) -> None:
    tree.behave('monitor', 'run')
    tree.executable('maglev_controller', 'controller', '#!/no/such/interpreter\n')
    code, output = tree.run()
    assert code == 1
    assert 'controller ended early with exit code 12' in output
    assert tree.alive() == []


def test_a_node_that_is_not_there_stops_before_the_start(tree: Tree) -> None:
    code, output = tree.run('--stage', 'hw_bridge')
    assert code == 2
    assert "no executable 'hw_bridge' of package 'maglev_hw_bridge'" in output
    assert tree.started() == []
    assert not tree.out.exists()


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_the_nodes_in_order(tree: Tree, number: signal.Signals) -> None:
    tree.behave('monitor', 'run')
    process = tree.start('--out', str(tree.out))
    tree.wait_started()
    process.send_signal(number)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 128 + number, output
    assert tree.ended() == ['reference', 'controller', 'plant', 'monitor', 'recorder']
    assert 'interrupted' in output
    assert tree.alive() == []


def test_killing_the_scenario_leaves_no_orphan(tree: Tree) -> None:
    tree.behave('monitor', 'run')
    process = tree.start('--out', str(tree.out))
    tree.wait_started()
    process.kill()
    process.communicate(timeout=20)
    deadline = time.monotonic() + 5.0
    while tree.alive() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert tree.alive() == []


def test_a_node_that_will_not_stop_is_killed(tree: Tree) -> None:
    library = tree.path / 'scenarios' / 'lib.sh'
    text = library.read_text()
    assert 'patience=8' in text
    library.write_text(text.replace('patience=8', 'patience=1').replace('patience=3', 'patience=1'))
    tree.behave('plant', 'stubborn')
    code, output = tree.run()
    assert code == 1
    assert 'stage did not end cleanly, exit code 137' in output
    assert tree.alive() == []


def test_ros2_run_is_used_where_it_is(tree: Tree) -> None:
    tree.script(tree.path / 'bin' / 'ros2', ROS2)
    code, output = tree.run(path=f'{tree.path}/bin:')
    assert code == 0, output
    assert 'maglev_reference reference --ros-args' in (tree.path / 'ros2').read_text()
    assert tree.ended() == ['reference', 'controller', 'plant', 'recorder']
    assert tree.alive() == []


def test_a_folder_that_cannot_be_written(tree: Tree) -> None:
    tree.out.write_text('a file')
    code, output = tree.run()
    assert code == 2
    assert f"cannot write to '{tree.out}'" in output
    assert tree.started() == []


def test_a_folder_that_holds_a_run_is_not_touched(tree: Tree) -> None:
    (tree.out / 'bag').mkdir(parents=True)
    code, output = tree.run()
    assert code == 2
    assert 'already holds a run' in output
    assert sorted(tree.out.iterdir()) == [tree.out / 'bag']


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        (['--speed', '3'], "unknown option '--speed'"),
        (['ellipse'], "unknown option 'ellipse'"),
        (['--mode', 'fast'], "--mode is 'fast', it must be one of: lockstep realtime"),
        (['--stage=model'], "--stage is 'model', it must be one of: plant hw_bridge"),
        (['--duration', 'long'], "--duration is 'long', it must be a number of seconds above 0"),
        (['--duration', '-1'], "--duration is '-1'"),
        (['--duration', '0'], "--duration is '0'"),
        (['--duration'], '--duration needs a value'),
        (['--params', 'none.yaml'], "there is no file 'none.yaml'"),
        (['--params', 'typo.yaml'], "parameters for 'contoller', which is no node"),
    ],
)
def test_options_that_make_no_sense(tree: Tree, options: list[str], words: str) -> None:
    (tree.path / 'typo.yaml').write_text('# why\n\ncontoller:\n  ros__parameters:\n    a: 1\n')
    code, output = tree.run(*options)
    assert code == 2
    assert words in output
    assert len(output.splitlines()) == 1
    assert tree.started() == []


def test_help_starts_nothing(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text('exit 70\n')
    code, output = tree.run('--help')
    assert code == 0
    for option in ('--stage', '--mode', '--duration', '--params', '--out'):
        assert option in output


def test_an_interrupt_is_heeded_where_it_was_ignored(tree: Tree) -> None:
    tree.behave('monitor', 'run')
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = tree.start('--out', str(tree.out))
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    tree.wait_started()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 130, output
    assert tree.alive() == []


def trajectory(tree: Tree, *options: str) -> tuple[int, str]:
    """Run the scenario of any trajectory."""
    process = subprocess.run(
        [tree.path / 'scenarios' / 'trajectory.sh', *options],
        cwd=tree.path,
        env={**os.environ, 'PATH': '/usr/bin:/bin'},
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    return process.returncode, process.stdout + process.stderr


def test_a_trajectory_is_chosen_by_name_or_file(tree: Tree) -> None:
    (tree.path / 'params' / 'scenario_file.yaml').write_text('/**:\n  ros__parameters: {}\n')
    code, output = trajectory(tree, 'ellipse', '--out', str(tree.out))
    assert code == 0, output
    assert 'file.path' not in ' '.join(tree.arguments('reference'))
    path = tree.path / 'a path.csv'
    path.write_text('t,y,x,z,phi,theta\n')
    code, output = trajectory(
        tree, path.name, '--out', str(tree.path / 'second'), '--duration', '3'
    )
    assert code in (0, 1), output  # the stand-in of the monitor writes to the first folder
    arguments = tree.arguments('reference')
    assert f"file.path:='{path}'" in arguments
    assert 'duration:=3.0' in arguments
    assert str(tree.path / 'params' / 'scenario_file.yaml') in arguments


@pytest.mark.parametrize(
    ('options', 'code', 'words'),
    [
        (['elipse'], 2, "the trajectory is 'elipse', it must be one of: ellipse"),
        (['none.csv'], 2, "cannot read 'none.csv'"),
        (['--out', 'x'], 2, "the trajectory is '--out'"),
        ([], 0, 'usage: scenarios/trajectory.sh NAME|FILE.csv'),
        (['ellipse', '--help'], 0, 'usage: scenarios/trajectory.sh NAME|FILE.csv'),
        (['ellipse', '--mode', 'fast'], 2, 'must be one of: lockstep realtime'),
    ],
)
def test_a_trajectory_that_makes_no_sense(
    tree: Tree, options: list[str], code: int, words: str
) -> None:
    found, output = trajectory(tree, *options)
    assert found == code, output
    assert words in output
    assert not tree.started()
