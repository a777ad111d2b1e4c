"""One run: the nodes' lives and ends. The nodes here are stand-ins."""

from __future__ import annotations

import json
import os
import pty
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from stand_ins import Tree

from runner import options, process
from runner.folder import make_folder


def test_a_run_that_passes(tree: Tree) -> None:
    code, output = tree.run()
    assert code == 0, output
    assert 'y 3.0 um' in output  # what the monitor says is seen
    assert 'recording' not in output  # not what is only logged
    assert 'ellipse: passed' in output
    for name in ('report.html', 'metrics.json', 'log'):
        assert f'{tree.out}/{name}' in output
    assert tree.ended() == ['reference', 'controller', 'plant', 'watchers', 'view']
    assert tree.alive() == []


def test_a_run_outside_its_limits_still_has_its_report(tree: Tree) -> None:
    tree.behave('watchers', 'miss')
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


@pytest.mark.parametrize('node', ['plant', 'controller', 'reference', 'watchers'])
def test_a_node_that_dies_ends_the_run(tree: Tree, node: str) -> None:
    tree.behave('watchers', 'run')
    tree.behave(node, 'die')
    code, output = tree.run()
    assert code == 1
    name = 'stage' if node == 'plant' else node
    assert f'{name} ended early with exit code 3: error: the belt broke' in output
    assert f'{tree.out}/log/{name}.log' in output
    assert tree.alive() == []


def test_a_node_that_cannot_be_executed(tree: Tree) -> None:
    tree.behave('watchers', 'run')
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
    tree.behave('watchers', 'run')
    process = tree.start('--out', str(tree.out))
    tree.wait_started()
    process.send_signal(number)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 128 + number, output
    assert tree.ended() == ['reference', 'controller', 'plant', 'watchers', 'view']
    assert 'interrupted' in output
    assert tree.alive() == []


def test_what_is_left_of_an_interrupted_run_is_told_with_quiet_too(tree: Tree) -> None:
    tree.behave('watchers', 'run')
    process = tree.start('--quiet', '--out', str(tree.out))
    tree.wait_started()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=20)
    assert output == f'ellipse: interrupted; what was recorded is kept in {tree.out}\n'


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
    tree.behave('watchers', 'run')
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
    assert 'SIGTERM: 8.0, signal.SIGINT: 3.0' in text
    module.write_text(
        text.replace('SIGTERM: 8.0, signal.SIGINT: 3.0', 'SIGTERM: 1, signal.SIGINT: 1')
    )
    tree.behave('plant', 'stubborn')
    code, output = tree.run()
    assert code == 1
    assert 'stage did not end cleanly, exit code 137' in output
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


def test_a_folder_that_vanishes_in_flight_is_told(tree: Tree) -> None:
    tree.behave('watchers', 'run')
    process = tree.start('--out', str(tree.out))
    tree.wait_started()
    tree.out.rename(tree.path / 'moved')
    os.kill(int((tree.path / 'pids' / 'controller').read_text()), signal.SIGKILL)
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 1
    assert f"cannot write to '{tree.out}': No such file or directory\nellipse: FAILED" in output


def test_a_folder_that_holds_a_run_is_not_touched(tree: Tree) -> None:
    (tree.out / 'bag').mkdir(parents=True)
    code, output = tree.run()
    assert code == 2
    assert 'already holds a run' in output
    assert sorted(tree.out.iterdir()) == [tree.out / 'bag']


def test_an_interrupt_is_heeded_where_it_was_ignored(tree: Tree) -> None:
    tree.behave('watchers', 'run')
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


def test_an_interrupt_of_the_script_alone_is_heeded_after_what_it_waits_for(tree: Tree) -> None:
    (tree.path / 'setup.sh').write_text(f'env sh -c "echo >{tree.path}/pids/setup up; sleep 0.5"\n')
    process = tree.start('--out', str(tree.out))
    tree.wait_started('setup')
    (tree.path / 'pids' / 'setup').unlink()
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=20)
    assert (process.returncode, output) == (-signal.SIGINT, '')
    assert not tree.out.exists()


def test_an_interrupt_before_the_first_line_of_the_runner_ends_it_without_a_word(
    tree: Tree,
) -> None:
    held = tree.path / 'held'
    slow = f'#!/bin/sh\nkill -INT $$\n: >{held}\nexec {sys.executable} "$@"\n'
    tree.script(tree.path / 'slow' / 'python', slow)
    with (tree.path / 'setup.sh').open('a') as setup:
        setup.write(f'PATH={tree.path}/slow:$PATH\n')
    assert tree.run() == (-signal.SIGINT, '')
    assert held.exists()
    assert not tree.out.exists()


def test_a_node_that_does_not_listen_yet_ends_without_a_word(tree: Tree) -> None:
    loading = f'#!{sys.executable}\nimport os, time\npids = {str(tree.path / "pids")!r}\n'
    loading += "open(f'{pids}/watchers', 'w').write(str(os.getpid()))\ntime.sleep(60)\n"
    tree.executable('maglev_monitor', 'watchers', loading)
    process = tree.start('--out', str(tree.out))
    tree.wait_started('watchers')
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=20)
    assert process.returncode == 130
    assert 'Traceback' not in output


def test_without_setpriv_the_nodes_run_all_the_same(tree: Tree) -> None:
    for name in ('bash', 'cat', 'dirname', 'readlink', 'sleep'):
        (tree.path / 'bin' / name).symlink_to(f'/usr/bin/{name}')
    out = ('--out', str(tree.out))
    code, output = tree.finish(*out, script='ellipse', path='/nowhere')
    assert code == 0, output
    tree.executable('maglev_controller', 'controller', '#!/no/such/interpreter\n')
    tree.behave('watchers', 'run')
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
    tree.behave('watchers', 'miss')
    tree.behave('controller', 'warn')
    code, output = tree.finish('--out', f'{tree.out}-2', '--quiet', script='ellipse')
    assert code == 1
    assert 'ellipse: controller: warning: ' in output
    assert output.endswith(f'ellipse: too far off\nellipse: FAILED, see {tree.out}-2\n')
    assert ' um' not in output


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
