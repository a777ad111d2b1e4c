"""From signals to the end of a process: in order, and no second signal cuts a landing short."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from functools import partial
from types import SimpleNamespace
from typing import Any

import pytest
from rclpy.duration import Duration

from maglev_node import process
from maglev_node.leaving import deliver
from maglev_node.node import NodeError
from maglev_node.signals import listen
from maglev_node.stage_node import StageNode

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Node:
    """A node whose poll of signals comes after what ``meanwhile`` does, at most a few times."""

    publishers: tuple[Any, ...] = ()
    exit_code = None

    def __init__(self, meanwhile: Callable[[], None], agrees: Callable[[], bool]) -> None:
        self._meanwhile, self._agrees = meanwhile, agrees
        self.happened: list[str] = []

    def get_name(self) -> str:
        return 'node'

    def spin(self, stop: Callable[[], bool]) -> None:
        for _ in range(5):
            self._meanwhile()
            time.sleep(0.001)
            if stop():
                return
        self.happened.append('never stopped')

    def may_stop(self) -> bool:
        self.happened.append('asked')
        return self._agrees()

    def close(self) -> None:
        self.happened.append('closed')

    def destroy_node(self) -> None:
        self.happened.append('destroyed')


@pytest.fixture(autouse=True)
def handlers(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """No middleware, and the handlers of before afterwards."""
    monkeypatch.setattr('sys.argv', ['node'])
    monkeypatch.setattr(process, 'prepare_middleware', lambda: None)
    monkeypatch.setattr(process, 'discovering', lambda _name: nullcontext())
    monkeypatch.setattr(process.rclpy, 'init', lambda **_: None)
    monkeypatch.setattr(process.rclpy, 'try_shutdown', lambda: None)
    before = [signal.getsignal(number) for number in ENDING]
    yield
    for number, handler in zip(ENDING, before, strict=True):
        signal.signal(number, handler)


def send(*numbers: signal.Signals) -> Callable[[], None]:
    """What sends the signals the first time it is called."""
    left = list(numbers)

    def meanwhile() -> None:
        while left:
            os.kill(os.getpid(), left.pop(0))

    return meanwhile


def run(node: Any) -> int:
    return process.run('node', listen(), lambda: node)


@pytest.mark.parametrize('number', ENDING)
def test_a_signal_ends_it_in_order(number: signal.Signals) -> None:
    node = Node(send(number), lambda: True)
    assert run(node) == 0
    assert node.happened == ['asked', 'closed', 'destroyed']


@pytest.mark.parametrize('second', ENDING)
@pytest.mark.parametrize('first', ENDING)
def test_two_signals_at_once_do_not_skip_the_landing(
    first: signal.Signals, second: signal.Signals
) -> None:
    node = Node(send(first, second), lambda: True)
    assert run(node) == 0
    assert node.happened == ['asked', 'closed', 'destroyed']


def test_a_second_signal_while_it_lands_does_not_cut_it_short() -> None:
    landed = []

    def lands() -> bool:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.002)
        landed.append(True)
        return True

    node = Node(send(signal.SIGINT), lands)
    assert run(node) == 0
    assert landed == [True]


def test_a_node_that_waits_is_ended_by_a_second_signal_and_by_no_first() -> None:
    node = Node(send(signal.SIGINT), lambda: False)
    run(node)
    assert node.happened == ['asked'] * 5 + ['never stopped', 'closed', 'destroyed']
    node = Node(send(signal.SIGINT, signal.SIGINT), lambda: False)
    assert run(node) == 0
    assert node.happened == ['asked', 'closed', 'destroyed']


SEVERAL = """
from maglev_node import node
from maglev_node.executable import run_nodes

class Made(node.MaglevNode):
    def __init__(self):
        super().__init__(self.called, node.NodeParameters)
        self.create_timer(self.after, self.act, clock=self.steady_clock)
    def act(self):
        print(self.called, flush=True)
        self.fail('broken') if self.fails else self.finish(self.code)
    def close(self): print('closed', self.called, flush=True)

def made(called, after, code=0, fails=False):
    return type(called, (Made,), dict(called=called, after=after, code=code, fails=fails))

run_nodes('several', {nodes})
"""


@pytest.mark.parametrize(
    ('nodes', 'code', 'said'),
    [
        ("made('a', 0.1), made('b', 1.5)", 0, ['a', 'b', 'closed a', 'closed b']),
        ("made('a', 0.1, code=3), made('b', 1.5)", 3, ['a', 'b', 'closed a', 'closed b']),
        ("made('a', 1.5), made('b', 0.1, code=3)", 3, ['b', 'a', 'closed a', 'closed b']),
        ("made('a', 60.0), made('b', 0.1, fails=True)", 1, ['b', 'closed a', 'closed b']),
    ],
)
def test_several_nodes_end_when_all_have_done_or_one_has_failed(
    nodes: str, code: int, said: list[str]
) -> None:
    """Their times are far apart, for a busy machine may let both timers become due at once."""
    program = SEVERAL.replace('{nodes}', nodes)
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=30, check=False
    )
    found = list(dict.fromkeys(done.stdout.splitlines()))  # a timer may tick twice
    assert (done.returncode, found) == (code, said), done.stderr


def test_what_stands_before_ros_args_is_no_parameter() -> None:
    program = SEVERAL.replace('{nodes}', "made('a', 0.1)")
    for command in (['--params-file', 'x.yaml'], ['--ros-args', '-p', 'x:=1', '--', 'left']):
        done = subprocess.run(
            [sys.executable, '-c', program, *command],
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
        assert (done.returncode, done.stdout) == (1, '')
        wrong = command[0] if command[0] != '--ros-args' else 'left'
        assert done.stderr.startswith(f"several: error: '{wrong}' is no argument: -p, -r and --par")


def test_who_acknowledges_nothing_is_waited_for_once_and_not_by_each_node(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    waited: list[float] = []

    def wait(longest: Duration) -> None:
        waited.append(1e-9 * longest.nanoseconds)
        time.sleep(waited[-1])

    monkeypatch.setattr(process, 'deliver', partial(deliver, at_most=0.1))
    nodes = [Node(send(signal.SIGINT), lambda: True) for _ in range(2)]
    for node in nodes:
        node.publishers = (SimpleNamespace(wait_for_all_acked=wait),) * 2
    process._close(nodes)
    assert sum(waited) <= 0.1
    assert [node.happened for node in nodes] == [['closed', 'destroyed']] * 2


def test_a_middleware_that_blocks_does_not_keep_the_process() -> None:
    program = (
        'import ctypes\n'
        'from maglev_node import executable, node, process\n'
        'class Stuck(node.MaglevNode):\n'
        '    def __init__(self): super().__init__("stuck", node.NodeParameters)\n'
        '    def spin(self, stop): pass\n'
        '    def close(self): print("closed", flush=True)\n'
        '    def destroy_node(self): ctypes.PyDLL(None).sleep(60)\n'  # and holds the interpreter
        'process._LEAVING_TIME = 0.2\n'
        'executable.run_nodes("stuck", Stuck)\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', program], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 1
    assert done.stdout == 'closed\n'
    assert 'Timeout' in done.stderr
    assert 'in destroy_node' in done.stderr


def test_a_hang_up_that_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    node = Node(send(signal.SIGHUP), lambda: True)
    run(node)
    assert 'asked' not in node.happened


@pytest.mark.parametrize('works', [True, False])
def test_a_defect_lands_or_releases(works: bool) -> None:
    done = []

    def land(why: str) -> None:
        done.append('lands')
        if not works:
            raise RuntimeError(why)

    node: Any = SimpleNamespace(
        _sampling=SimpleNamespace(land=land, release=lambda: done.append('released')),
        get_logger=lambda: SimpleNamespace(fatal=lambda _text: None),
    )
    StageNode.rescue(node)
    assert done == (['lands'] if works else ['lands', 'released'])


def test_a_stage_is_touched_only_once_its_place_is_taken() -> None:
    touched: list[str] = []
    stage = SimpleNamespace(configure=lambda: touched.append('boards'))

    def claim(_topic: str, _kind: str) -> None:
        raise NodeError('another one is there')

    node: Any = SimpleNamespace(
        parameters=None, _make_stage=lambda _: stage, _graph=SimpleNamespace(claim=claim)
    )
    with pytest.raises(NodeError):
        StageNode.configure(node)
    assert touched == []
