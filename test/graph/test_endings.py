"""What a node holds of the system, and how it ends."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from flight import LONG, airborne, fly
from graph import Nodes, Observer
from rclpy.utilities import get_rmw_implementation_identifier

from maglev_monitor.bag.columns import table
from maglev_msgs.msg import ControllerState


def shared_memory(pid: int) -> list[str]:
    """What a process that uses Fast DDS shares with others for their messages."""
    return re.findall(r'/dev/shm/\S*fastrtps\S*', Path(f'/proc/{pid}/maps').read_text())


@pytest.mark.skipif(
    get_rmw_implementation_identifier() != 'rmw_fastrtps_cpp', reason='another middleware'
)
@pytest.mark.parametrize(
    ('name', 'arguments', 'ready'),
    [
        ('plant', (), 'activate: active'),
        (
            'hw_bridge',
            ('autostart:=true', 'homing.at_start:=true', 'homing.x:=0.0', 'homing.z:=0.0'),
            'activate: active',
        ),
        ('controller', (), 'waiting for'),
        ('monitor', (), 'is seen'),
    ],
)
def test_no_node_shares_memory_which_another_could_lock(
    nodes: Nodes, name: str, arguments: tuple[str, ...], ready: str
) -> None:
    node = nodes.start(name, *arguments)
    node.wait_for(ready)
    assert not shared_memory(node.pid)
    node.signal(signal.SIGINT)
    assert node.wait() == 0, node.output


def test_what_never_waits_in_real_time_ends_in_order_and_says_so(nodes: Nodes) -> None:
    stage = nodes.start('plant')
    stage.wait_for('activate: active')
    stage.signal(signal.SIGXCPU)
    assert stage.wait() == 1
    assert 'too slow or too busy for real time' in stage.output


EARLY = """
import os, signal, sys

class Early:
    def find_spec(self, name, path=None, target=None):
        if name == 'rclpy':
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Early())
from maglev_monitor.executables import watchers
watchers()
"""


def test_a_signal_during_its_imports_ends_it_in_order_too(tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    command = [sys.executable, '-c', EARLY, '--ros-args', '-p', f'recorder:output:={bag}']
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 0, done.stderr
    assert 'Traceback' not in done.stderr
    assert (bag / 'metadata.yaml').exists()


def test_its_last_words_reach_a_recorder_that_lags(
    nodes: Nodes, watching: Observer, tmp_path: Path
) -> None:
    recorder = nodes.start('recorder', f'output:={tmp_path / "bag"}')
    graph = fly(nodes, LONG, watched=('watchers:=[observer, recorder]',))
    watching.wait(lambda: airborne(watching))
    recorder.signal(signal.SIGSTOP)
    graph['controller'].signal(signal.SIGTERM)
    graph['controller'].wait_for('disabled at sample')
    time.sleep(0.7)
    recorder.signal(signal.SIGCONT)
    assert graph['controller'].wait() == 0
    recorder.signal(signal.SIGINT)
    assert recorder.wait() == 0, recorder.output
    modes = table(tmp_path / 'bag').columns['mode']
    assert modes[modes >= 0][-1] == ControllerState.DISABLED
    assert np.count_nonzero(modes == ControllerState.LANDING) > 900
