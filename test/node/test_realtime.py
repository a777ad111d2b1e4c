"""What a process that must be on time takes, and what it leaves alone when it may not."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from maglev_node.realtime import take_processors
from maglev_node.topics import KEPT

UNHEARD = Path(__file__).resolve().parents[1] / 'support' / 'unheard.py'

CODE = """
import re, resource, os
from maglev_node.realtime import lock_memory, take_priority

done = lock_memory()
status = open('/proc/self/status').read()
locked = int(re.search(r'VmLck:\\s+(\\d+)', status)[1])
assert done == (locked > 0), (done, locked)
more = bytearray(50_000_000)  # can still be had
taken = take_priority(40)
assert taken == (os.sched_getscheduler(0) == os.SCHED_FIFO)
"""

THREADS = """
import os, pathlib, rclpy
from maglev_node.realtime import take_priority
from maglev_node.topics import REFERENCE, SAMPLE_TOPICS, reference_qos

rclpy.init()
node = rclpy.create_node('made_up')
node.create_publisher(SAMPLE_TOPICS[REFERENCE], REFERENCE, reference_qos())
for priority in {priorities}:
    if not take_priority(priority):
        print('not permitted')
        break
    for thread in pathlib.Path('/proc/self/task').iterdir():
        own = os.sched_getparam(int(thread.name)).sched_priority
        print(priority, own, thread.joinpath('comm').read_text().strip(), flush=True)
os._exit(0)
"""


def test_a_thread_that_spins_gives_way_to_the_one_it_waits_for() -> None:
    code = THREADS.format(priorities=(1, 40))
    done = subprocess.run([sys.executable, '-c', code], check=True, capture_output=True, text=True)
    if 'not permitted' in done.stdout:
        pytest.skip('no real-time priority here (ulimit -r)')
    threads = [line.split(maxsplit=2) for line in done.stdout.splitlines()]
    for priority in ('1', '40'):
        below = [name for given, own, name in threads if given == priority and own != given]
        assert below
        assert all(name.startswith('dds.asyn') for name in below)
        assert not any(
            name.startswith('dds.asyn') for *same, name in threads if same == [priority] * 2
        )


@pytest.mark.parametrize(
    ('deaf', 'ends'), [(False, signal.SIGXCPU), (True, signal.SIGKILL)], ids=['told', 'killed']
)
def test_what_spins_without_end_ends_not_the_machine(deaf: bool, ends: signal.Signals) -> None:
    code = (
        f'import signal; {deaf} and signal.signal(signal.SIGXCPU, signal.SIG_IGN)\n'
        'from maglev_node import realtime\n'
        'realtime._LONGEST_BURST = 300_000, 600_000\n'
        'if not realtime.take_priority(1): raise SystemExit("not permitted")\n'
        'while True: pass\n'
    )
    done = subprocess.run(
        [sys.executable, '-c', code], check=False, capture_output=True, text=True, timeout=60
    )
    if 'not permitted' in done.stderr:
        pytest.skip('no real-time priority here (ulimit -r)')
    assert done.returncode == -ends


def test_what_is_permitted_is_taken() -> None:
    done = subprocess.run([sys.executable, '-c', CODE], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize('mode', KEPT)
def test_a_reader_that_is_stopped_costs_no_new_memory_with_every_sample(mode: str) -> None:
    """The middleware makes a longer copy, each time, of what that has not acknowledged."""
    command = [sys.executable, str(UNHEARD), mode]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    faults = [float(line) for line in done.stdout.splitlines()]
    # 0.2 in real time where the copies grow, 50 and more in lockstep with the heap as glibc has it
    assert max(faults) < (0.1 if mode == 'realtime' else 1.0)


def test_under_a_limit_memory_is_left_alone() -> None:
    limited = (
        'import os, resource; resource.setrlimit(resource.RLIMIT_MEMLOCK, (2**20, 2**20));'
        'os.geteuid = lambda: 1000\n'
        'from maglev_node.realtime import lock_memory\n'
        'assert not lock_memory()'
    )
    assert subprocess.run([sys.executable, '-c', limited], check=False).returncode == 0


def test_all_threads_run_where_they_are_told_to_and_those_begun_later() -> None:
    code = """
import os, threading
from pathlib import Path
from maglev_node.realtime import take_processors

chosen, end = max(os.sched_getaffinity(0)), threading.Event()
threading.Thread(target=end.wait).start()
take_processors((chosen,))
threading.Thread(target=end.wait).start()
threads = [int(entry.name) for entry in Path('/proc/self/task').iterdir()]
found = [os.sched_getaffinity(thread) for thread in threads]
end.set()
assert len(found) > 2 and all(one == {chosen} for one in found), found
"""
    subprocess.run([sys.executable, '-c', code], check=True)


def test_told_nothing_they_run_anywhere() -> None:
    before = os.sched_getaffinity(0)
    take_processors(())
    assert os.sched_getaffinity(0) == before
