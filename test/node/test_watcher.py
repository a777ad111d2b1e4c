"""How the process of a node that watches stands to the loop's, by the mode that the stage tells."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from maglev_model.contract.wire import Outgoing
from maglev_node.topics import KEYS, MEASUREMENT

WATCHER = """
import json, os, pathlib, sys
import rclpy
from maglev_node.watcher import WatcherNode, WatcherParameters

rclpy.init(args=sys.argv)
node = WatcherNode('made_up', WatcherParameters)


def ranks():
    threads = [int(thread.name) for thread in pathlib.Path('/proc/self/task').iterdir()]
    own = {(os.sched_getparam(thread).sched_priority, os.getpriority(0, thread))
           for thread in threads if 'dds.asyn' not in open(f'/proc/self/task/{thread}/comm').read()}
    return sorted(own)


seen = [ranks()]
for messages in json.loads(sys.argv[1]):
    node.acknowledge([bytes.fromhex(message) for message in messages])
    seen.append(ranks())
node.close()
seen.append(ranks())
print(json.dumps(seen), flush=True)
os._exit(0)
"""


OWN = os.nice(0)
NICE = max(OWN, 5)


def measured(*, lockstep: bool) -> str:
    message = Outgoing(KEYS[MEASUREMENT], 'stage')
    message['lockstep'] = lockstep
    return message.serialized().hex()


def ranks(*taken: list[str], parameters: str = '') -> Any:
    """SCHED_FIFO priority and niceness of its threads: at first, after each taking, at the end."""
    command = [sys.executable, '-c', WATCHER, json.dumps(taken), '--ros-args', '-p']
    command.append(parameters or 'realtime_priority:=10')
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def test_in_lockstep_it_yields() -> None:
    seen = ranks([], [measured(lockstep=True)], [measured(lockstep=False)])
    assert seen == [[[0, OWN]], [[0, OWN]], [[0, NICE]], [[0, NICE]], [[0, NICE]]]


def test_in_real_time_it_comes_before_other_work() -> None:
    seen = ranks(['00'], [measured(lockstep=False)] * 2, [measured(lockstep=True)])
    if seen[2] == [[0, OWN]]:
        pytest.skip('no real-time priority here (ulimit -r)')
    assert seen == [[[0, OWN]], [[0, OWN]], [[10, OWN]], [[10, OWN]], [[0, OWN]]]


def test_without_a_priority_it_is_as_others_are() -> None:
    seen = ranks([measured(lockstep=False)], parameters='realtime_priority:=0')
    assert seen == [[[0, OWN]], [[0, OWN]], [[0, OWN]]]
