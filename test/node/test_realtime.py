"""What a process that must be on time takes, and what it leaves alone when it may not."""

from __future__ import annotations

import subprocess
import sys

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


def test_what_is_permitted_is_taken() -> None:
    done = subprocess.run([sys.executable, '-c', CODE], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_under_a_limit_memory_is_left_alone() -> None:
    limited = (
        'import os, resource; resource.setrlimit(resource.RLIMIT_MEMLOCK, (2**20, 2**20));'
        'os.geteuid = lambda: 1000\n'
        'from maglev_node.realtime import lock_memory\n'
        'assert not lock_memory()'
    )
    assert subprocess.run([sys.executable, '-c', limited], check=False).returncode == 0
