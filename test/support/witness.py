"""Whether the machine itself keeps time: a thread of real-time priority on every processor.

A kernel or a hypervisor takes a processor away for 50 ms and more, from SCHED_FIFO too. What flies
in real time is lost then, whatever the software does.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time

from maglev_node.realtime import take_priority

TOLERATED = 0.004  # by which a thread may be late on a machine that keeps time [s]
SHORT = 0.0005  # by which it may be late without a sample of 1 ms being so [s]
_PERIOD = 0.002


class Witness:
    """Watches from entry to exit.

    ``worst`` is by how much a thread was late [s], ``share`` how often by more than :data:`SHORT`.
    """

    def __init__(self) -> None:
        self.worst = self.share = 0.0

    def __enter__(self) -> Witness:
        self._process = subprocess.Popen(
            [sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == 'watching\n'
        return self

    def __exit__(self, *_: object) -> None:
        said = self._process.communicate()[0]  # the end of its input ends it
        self.worst, self.share = json.loads(said)

    @property
    def disturbed(self) -> bool:
        """Whether the machine did not keep time."""
        return self.worst > TOLERATED


def _main() -> None:
    take_priority(98)
    processors = os.sched_getaffinity(0)
    worst, looks, late = (dict.fromkeys(processors, 0.0) for _ in range(3))

    def watch(processor: int) -> None:
        os.sched_setaffinity(0, {processor})
        while True:
            due = time.monotonic() + _PERIOD
            time.sleep(_PERIOD)
            by = time.monotonic() - due
            worst[processor] = max(worst[processor], by)
            looks[processor] += 1.0
            late[processor] += by > SHORT

    for processor in processors:
        threading.Thread(target=watch, args=(processor,), daemon=True).start()
    print('watching', flush=True)
    sys.stdin.read()
    print(json.dumps([max(worst.values()), sum(late.values()) / max(sum(looks.values()), 1.0)]))


if __name__ == '__main__':
    _main()
