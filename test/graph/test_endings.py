"""A node that ends gives back what the middleware holds for it."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path

import pytest
from graph import Nodes
from rclpy.utilities import get_rmw_implementation_identifier


def shared_memory(pid: int) -> set[Path]:
    """The segments of its own through which a process that uses Fast DDS gives its messages.

    Those of the ports, which have a name, belong to all processes of a domain.
    """
    maps = Path(f'/proc/{pid}/maps').read_text()
    return {Path(name) for name in re.findall(r'/dev/shm/fastrtps_[0-9a-f]{16}\b', maps)}


@pytest.mark.skipif(
    get_rmw_implementation_identifier() != 'rmw_fastrtps_cpp', reason='another middleware'
)
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ('name', 'arguments'),
    [
        ('plant', ()),
        ('hw_bridge', ()),
        ('hw_bridge', ('autostart:=false',)),
        ('controller', ()),
        ('reference', ()),
        ('monitor', ()),
    ],
)
def test_no_shared_memory_stays(
    nodes: Nodes, name: str, arguments: tuple[str, ...], number: signal.Signals
) -> None:
    node = nodes.start(name, *arguments)
    deadline = time.monotonic() + 30
    while not (held := shared_memory(node.pid)):
        assert node.running, node.output
        assert time.monotonic() < deadline
        time.sleep(0.05)
    time.sleep(0.2)
    node.signal(number)
    assert node.wait() == 0, node.output
    assert not [path for path in held if path.exists()]


def test_what_never_waits_in_real_time_ends_in_order_and_says_so(nodes: Nodes) -> None:
    stage = nodes.start('plant')
    stage.wait_for('activate: active')
    stage.signal(signal.SIGXCPU)
    assert stage.wait() == 1
    assert 'too slow or too busy for real time' in stage.output


def test_what_a_killed_process_has_locked_keeps_no_node_from_coming_up(nodes: Nodes) -> None:
    if get_rmw_implementation_identifier() != 'rmw_fastrtps_cpp':
        pytest.skip('only Fast DDS locks ports in shared memory')
    first = 7400 + 250 * int(os.environ['ROS_DOMAIN_ID'])
    locks = [Path(f'/dev/shm/sem.fastrtps_port{first + offset}_mutex') for offset in (11, 13, 15)]
    for lock in locks:  # as a process leaves them that is killed while it makes the port
        lock.write_bytes(bytes(8) + b'\x80' + bytes(23))
        lock.with_name(lock.name[4:-6]).write_bytes(b'')
    recorder = nodes.start('recorder', f'output:={nodes.folder / "bag"}')
    recorder.wait_for('recording to', timeout=15.0)
    recorder.signal(signal.SIGINT)
    assert recorder.wait() == 0
    assert all(not lock.exists() or lock.read_bytes()[0] == 1 for lock in locks)
