"""One run: options, the nodes' lives and ends. The nodes here are stand-ins."""

from __future__ import annotations

import json
import os
import pty
import resource
import signal
import subprocess
from pathlib import Path

import pytest
from stand_ins import NODES, ROOT, Tree

from runner import logs, options, overlays, process
from runner.folder import make_folder

WATCHERS = "watchers:=['monitor','recorder']"

# As the real one: waits for its child, also through Ctrl-C, which the child has seen as well.
ROS2 = r"""#!/usr/bin/env python3
import subprocess
import sys

assert sys.argv[1:3] == ['run', '--prefix'], sys.argv
package, executable = sys.argv[4:6]
print('[ros2run]: this is not the node')
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
    tree.parameters('mine.yaml', 'controller')
    tree.parameters('params/machine.yaml')
    options = ('--mode', 'realtime', '--duration=3', '--params', 'soft', '--params', 'mine.yaml')
    code, output = tree.run(*options)
    assert code == 0, output
    over = ['params/scenario_ellipse.yaml', 'params/soft.yaml', 'mine.yaml']
    assert tree.files('plant') == ['params/machine.yaml', 'params/plant.yaml', *over]
    for node in NODES:
        assert tree.files(node)[0] == 'params/machine.yaml'
        assert tree.files(node)[-3:] == over
        assert f'effective_parameters:={tree.out}/params/{node}.yaml' in tree.arguments(node)
    assert {'mode:=realtime', WATCHERS} <= set(tree.arguments('plant'))
    reference = tree.arguments('reference')
    assert {'duration:=3.0', 'autostart:=true', WATCHERS, 'lead:=128'} <= set(reference)
    monitor = tree.arguments('monitor')
    assert {f'output:={tree.out}/metrics.json', 'scenario:=ellipse', 'stage:=plant'} <= set(monitor)
    assert f'output:={tree.out}/bag' in tree.arguments('recorder')


def test_without_a_machine_file_each_node_starts_with_its_own(tree: Tree) -> None:
    assert tree.run()[0] == 0
    assert tree.files('plant') == ['params/plant.yaml', 'params/scenario_ellipse.yaml']
    assert tree.files('controller') == ['params/scenario_ellipse.yaml']
    assert not [word for word in tree.arguments('reference') if 'duration' in word]


def test_a_run_outside_its_limits_still_has_its_report(tree: Tree) -> None:
    tree.behave('monitor', '1')
    code, output = tree.run()
    assert code == 1
    assert 'FAILED' in output
    assert (tree.out / 'report.html').exists()


def test_a_run_without_a_report_fails(tree: Tree) -> None:
    broken = '#!/usr/bin/env bash\necho "error: no bag"\nexit 2\n'
    tree.executable('maglev_monitor', 'analyze', broken)
    code, output = tree.run()
    assert code == 1
    assert 'ellipse: failed: no report: error: no bag\nellipse: FAILED' in output


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


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
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


def test_a_signal_ends_the_analysis(tree: Tree) -> None:
    tree.behave('analyze', 'hang')
    process = tree.start('--out', str(tree.out))
    tree.wait_started('analyze')
    process.send_signal(signal.SIGTERM)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 143, output
    assert 'passed' not in output
    assert tree.alive() == []


def test_killing_the_scenario_leaves_no_orphan(tree: Tree) -> None:
    tree.behave('monitor', 'run')
    process = tree.start('--out', str(tree.out))
    tree.wait_started()
    process.kill()
    process.communicate(timeout=20)
    tree.wait_gone()


def test_a_run_goes_on_when_nobody_reads_it_any_more(tree: Tree) -> None:
    process = tree.start('--out', str(tree.out))
    assert process.stdout is not None
    process.stdout.close()
    assert process.wait(timeout=20) == 0
    assert (tree.out / 'report.html').exists()


def test_a_node_that_will_not_stop_is_killed(tree: Tree) -> None:
    module = tree.path / 'scenarios' / 'runner' / 'process.py'
    text = module.read_text()
    assert 'SIGINT: 8.0, signal.SIGTERM: 3.0' in text
    module.write_text(
        text.replace('SIGINT: 8.0, signal.SIGTERM: 3.0', 'SIGINT: 1, signal.SIGTERM: 1')
    )
    tree.behave('plant', 'stubborn')
    code, output = tree.run()
    assert code == 1
    assert 'stage did not end cleanly, exit code 137' in output
    assert tree.alive() == []


def test_ros2_run_is_used_where_it_is(tree: Tree) -> None:
    tree.script(tree.path / 'bin' / 'ros2', ROS2)
    code, output = tree.run()
    assert code == 0, output
    assert 'maglev_reference reference --ros-args' in (tree.path / 'ros2').read_text()
    assert 'this is not the node' not in output
    assert tree.ended() == ['reference', 'controller', 'plant', 'recorder']
    assert tree.alive() == []


def test_a_folder_that_cannot_be_written(tree: Tree) -> None:
    tree.out.write_text('a file')
    code, output = tree.run()
    assert code == 2
    assert f"cannot write to '{tree.out}'" in output
    assert tree.started() == []


def test_a_full_disk_shows_before_the_start(tmp_path: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(options.WrongUseError, match='check its permissions and the space left'):
            make_folder(tmp_path / 'run')
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert list((tmp_path / 'run').iterdir()) == []


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
        (['--out='], '--out needs a folder'),
        (['--params', 'none.yaml'], "there is no file 'none.yaml'"),
        (['--params', 'typo.yaml'], "parameters for 'contoller', which is no node"),
        (['--params', 'twice.yaml'], "'speed' is given twice"),
        (['--params', 'other.yaml', '--namespace', 'b'], "parameters for '/a/plant', which is no"),
        (['--namespace', ''], "--namespace is ''"),
        (['--namespace', '/'], "--namespace is '/'"),
        (['--namespace', '1st'], "--namespace is '1st', it must be names of letters"),
        (['--namespace', 'a/'], "--namespace is 'a/'"),
        (['--namespace', 'a//b'], "--namespace is 'a//b'"),
        (['--namespace', 'a__b'], "--namespace is 'a__b'"),
        (['--namespace', 'a-b'], "--namespace is 'a-b'"),
        (['--params', 'flat.yaml'], "section 'controller' must hold 'ros__parameters'"),
    ],
)
def test_options_that_make_no_sense(tree: Tree, options: list[str], words: str) -> None:
    (tree.path / 'typo.yaml').write_text('# why\n\ncontoller:\n  ros__parameters:\n    a: 1\n')
    (tree.path / 'twice.yaml').write_text('plant:\n  ros__parameters: {speed: 1, speed: 2}\n')
    (tree.path / 'other.yaml').write_text('/a/plant:\n  ros__parameters: {speed: 1}\n')
    (tree.path / 'flat.yaml').write_text('controller:\n  speed: 1\n')
    code, output = tree.run(*options)
    assert code == 2
    assert words in output
    assert output.startswith('ellipse: error: ')
    assert len(output.splitlines()) == 1
    assert tree.started() == []
    assert not tree.out.exists()


def test_help_starts_nothing(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text('exit 70\n')
    code, output = tree.run('--help')
    assert code == 0
    for option in ('--stage', '--mode', '--duration', '--params', '--namespace', '--out'):
        assert option in output


def test_what_is_wrong_is_said_before_the_set_up_where_there_is_a_python(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text('echo set-up\nexit 70\n')
    code, output = tree.run('--mode', 'fast')
    assert code == 2
    assert "--mode is 'fast'" in output
    assert tree.run() == (70, 'set-up\n')
    tree.script(tree.path / 'bin' / 'python3', '#!/usr/bin/env bash\nexit 1\n')
    assert tree.run('--mode', 'fast') == (70, 'set-up\n')


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


def test_the_set_up_is_interrupted_where_that_was_ignored(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text(f'echo >{tree.path}/pids/setup up; sleep 60\n')
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = tree.start('--out', str(tree.out))
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    tree.wait_started('setup')
    (tree.path / 'pids' / 'setup').unlink()
    os.killpg(process.pid, signal.SIGINT)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == -signal.SIGINT, output
    assert not tree.out.exists()


def test_a_trajectory_is_chosen_by_name_or_file(tree: Tree) -> None:
    tree.parameters('params/scenario_file.yaml')
    code, output = tree.finish('ellipse', '--out', str(tree.out), script='trajectory')
    assert code == 0, output
    assert 'file.path' not in ' '.join(tree.arguments('reference'))
    path = tree.path / "a path's.csv"
    path.write_text('t,y,x,z,phi,theta\n')
    second = str(tree.path / 'second')
    code, output = tree.finish(path.name, '--out', second, '--duration', '3', script='trajectory')
    assert code == 0, output
    arguments = tree.arguments('reference')
    assert f"file.path:='{tree.path}/a path''s.csv'" in arguments
    assert 'duration:=3.0' in arguments
    assert 'params/scenario_file.yaml' in tree.files('reference')


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
    found, output = tree.finish(*options, script='trajectory')
    assert found == code, output
    assert words in output
    assert not tree.started()


def test_the_shipped_overlays_are_taken() -> None:
    others = ROOT / 'params' / 'rosbag2_qos.yaml'  # is for rosbag2
    for path in sorted({*(ROOT / 'params').rglob('*.yaml')} - {others}):
        name = str(path.relative_to(ROOT / 'params').with_suffix(''))
        assert overlays.overlay('--params', name) == str(path)
        overlays.check_overlay(str(path))


@pytest.mark.parametrize(
    ('log', 'words'),
    [
        ('[INFO] up\nFATAL: no encoder\nit ends\n\n', 'FATAL: no encoder'),
        ('[INFO] up\nlast\n[ros2run]: error: process exited\n', 'last'),
        ('\n', ''),
    ],
)
def test_last_words(tmp_path: Path, log: str, words: str) -> None:
    (tmp_path / 'log').write_text(log)
    assert process.last_words(tmp_path / 'log') == words
    assert process.last_words(tmp_path / 'none') == ''


def test_warnings_of_every_node_are_shown_once(tree: Tree) -> None:
    tree.behave('controller', 'warn')
    tree.behave('plant', 'warn')
    code, output = tree.run()
    assert code == 0, output
    for node in ('controller', 'stage'):
        for words in ('warning: the belt slips', 'error: the belt: broke', 'error: no end'):
            assert output.count(f'ellipse: {node}: {words}\n') == 1, output
    assert 'all is well' not in output


def test_the_reason_of_an_early_end_is_said_once(tree: Tree) -> None:
    tree.behave('monitor', 'run')
    tree.behave('controller', 'fail')
    code, output = tree.run()
    assert code == 1
    assert output.count('the belt broke') == 1, output
    assert 'ellipse: controller: error: the belt broke\n' in output
    assert 'ellipse: failed: controller ended early with exit code 1\n' in output


def test_a_node_that_warns_without_end_does_not_flood_the_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'controller.log'
    log.write_text(''.join(f'WARN 1.{n} late at sample {n}\n' for n in range(100)))
    shown = logs.NodeLog('ellipse: controller', log)
    shown.show()
    lines = capsys.readouterr().err.splitlines()
    assert lines[:20] == [f'ellipse: controller: warning: late at sample {n}' for n in range(20)]
    assert lines[20:] == [f'ellipse: controller: more warnings and errors are in {log}']


def test_what_the_monitor_logs_is_shown_like_that_of_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'log'
    log.write_text('y 3.0 um\nWARN 1.0 no node of the run is seen\ny 3.0 um\n')
    logs.NodeLog('ellipse: monitor', log, everything=True).show()
    captured = capsys.readouterr()
    assert captured.out == 'y 3.0 um\ny 3.0 um\n'
    assert captured.err == 'ellipse: monitor: warning: no node of the run is seen\n'


@pytest.mark.parametrize(('given', 'full'), [('stage1', '/stage1'), ('/lab/b_2', '/lab/b_2')])
def test_all_nodes_are_in_the_namespace(tree: Tree, given: str, full: str) -> None:
    tree.parameters('mine.yaml', f'{full}/controller')
    code, output = tree.run('--namespace', given, '--params', 'mine.yaml')
    assert code == 0, output
    assert f'ellipse: plant, lockstep in {full}, into {tree.out}' in output
    for node in NODES:
        words = tree.arguments(node)
        assert words[words.index('-r') + 1] == f'__ns:={full}'
        assert tree.files(node)[-1] == 'mine.yaml'


def test_without_a_namespace_none_is_set(tree: Tree) -> None:
    assert tree.run()[0] == 0
    assert '-r' not in tree.arguments('plant')


def test_runs_in_namespaces_are_left_apart(tree: Tree) -> None:
    code, output = tree.finish('--namespace', 'lab/b', script='ellipse')
    assert code == 0, output
    (folder,) = (tree.path / 'runs').iterdir()
    assert folder.name.startswith('ellipse-lab-b-')


def test_progress_is_shown_in_whole_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / 'log'
    progress = logs.NodeLog('ellipse: monitor', log, everything=True)
    progress.show()
    shown = []
    for text in ('y 3.0', ' um\nx', ' 4\n[ros2run]: hm\n', 'last'):
        with log.open('a') as file:
            file.write(text)
        progress.show()
        shown.append(capsys.readouterr().out)
    progress.show(rest=True)
    assert [*shown, capsys.readouterr().out] == ['', 'y 3.0 um\n', 'x 4\n', '', 'last\n']


def test_without_setpriv_the_nodes_run_all_the_same(tree: Tree) -> None:
    for name in ('bash', 'cat', 'dirname', 'sleep'):
        (tree.path / 'bin' / name).symlink_to(f'/usr/bin/{name}')
    out = ('--out', str(tree.out))
    code, output = tree.finish(*out, script='ellipse', path='/nowhere')
    assert code == 0, output
    tree.executable('maglev_controller', 'controller', '#!/no/such/interpreter\n')
    tree.behave('monitor', 'run')
    second = ('--out', str(tree.path / 'second'))
    code, output = tree.finish(*second, script='ellipse', path='/nowhere')
    assert code == 1
    assert 'ellipse: failed: [Errno 2] No such file' in output
    assert f'{tree.path}/prefix/lib/maglev_controller/controller' in output
    assert tree.alive() == []


def test_a_program_that_leaves_a_child_is_ended_with_it(tmp_path: Path) -> None:
    command = ['bash', '-c', f'sleep 60 & echo $! >{tmp_path}/pid; exit 4']
    program = process.Process(command, tmp_path / 'log')
    assert program._process.wait(10) == 4
    child = int((tmp_path / 'pid').read_text())
    os.kill(child, 0)
    program.stop(lambda duration: None)
    assert program.code == 4
    ended = subprocess.run(
        ['bash', '-c', f'sleep 0.2; grep State /proc/{child}/status'],
        capture_output=True,
        text=True,
        check=False,
    )
    assert 'Z' in ended.stdout or not ended.stdout


def test_quietly_only_what_is_wrong_is_said(tree: Tree) -> None:
    assert tree.run('--quiet') == (0, '')
    assert (tree.out / 'report.html').exists()
    tree.behave('monitor', '1')
    tree.behave('controller', 'warn')
    code, output = tree.finish('--out', f'{tree.out}-2', '--quiet', script='ellipse')
    assert code == 1
    assert 'ellipse: controller: warning: ' in output
    assert output.endswith(f'ellipse: FAILED, see {tree.out}-2\n')
    assert 'um' not in output


def test_json_is_all_there_is_on_the_standard_output(tree: Tree) -> None:
    process = subprocess.Popen(
        [tree.path / 'scenarios' / 'ellipse.sh', '--json', '--out', tree.out],
        env={**os.environ, 'PATH': f'{tree.path}/bin:/usr/bin:/bin'},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    out, err = process.communicate(timeout=30)
    outcome = json.loads(out)
    assert outcome['passed'] is True
    assert (outcome['scenario'], outcome['stage'], outcome['mode']) == (
        *('ellipse', 'plant', 'lockstep'),
    )
    assert outcome['out'] == str(tree.out)
    assert 'metrics' in outcome
    assert 'ellipse: passed' in err
    assert '\033' not in out + err


@pytest.mark.parametrize('no_color', [True, False])
def test_colours_are_for_a_terminal_that_wants_them(tree: Tree, no_color: bool) -> None:
    reader, writer = pty.openpty()
    environment = {**os.environ, 'PATH': f'{tree.path}/bin:/usr/bin:/bin'}
    environment.pop('NO_COLOR', None)
    process = subprocess.Popen(
        [tree.path / 'scenarios' / 'ellipse.sh', '--out', tree.out],
        env={**environment, 'NO_COLOR': '1'} if no_color else environment,
        stdout=writer,
        stderr=writer,
    )
    os.close(writer)
    output = b''
    while True:
        try:
            output += os.read(reader, 4096)
        except OSError:  # all ends are closed
            break
    os.close(reader)
    assert process.wait(30) == 0
    passed = b'ellipse: passed' if no_color else b'\033[32mellipse: passed\033[0m'
    assert passed in output
    assert (b'\033' in output) != no_color
