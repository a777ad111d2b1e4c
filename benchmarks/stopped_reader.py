"""What a reader that is stopped, or gone without a word, costs the writer with every sample.

Such a reader acknowledges nothing, and Fast DDS keeps a list of what each reader has still to
acknowledge, which it makes longer by one at a time: by a copy of all of it. Publishes 1,000
measurements a second to a subscriber that is stopped (SIGSTOP), at each depth of the writer's
history, with the heap as glibc has it and kept (:func:`maglev_node.realtime.keep_heap`), and prints
the median time of a publish [us] second by second. ``stopped_reader.py [SECONDS]``
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / 'test' / 'support'))
from unheard import unheard

from maglev_model.contract.wire import KEPT, Outgoing
from maglev_node.realtime import keep_heap
from maglev_node.topics import KEYS, MEASUREMENT


def publish(depth: int, seconds: int) -> None:
    """Print what a publish takes, a second after the other."""
    message = Outgoing(KEYS[MEASUREMENT], 'stage')
    with unheard(depth) as publisher:
        due = time.perf_counter()
        for _ in range(seconds):
            took = []
            for _ in range(1000):
                due += 1e-3
                time.sleep(max(due - time.perf_counter(), 0.0))
                begun = time.perf_counter()
                publisher.publish(message.serialized())
                took.append(time.perf_counter() - begun)
            print(f' {1e6 * statistics.median(took):5.0f}', end='', flush=True)
    print()


def main() -> None:
    """All of them, each in a process of its own, or one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('seconds', nargs='?', type=int, default=18, help='of each (default 18)')
    parser.add_argument('--depth', type=int, help='of the only one')
    parser.add_argument('--keep-heap', action='store_true', help='in the only one')
    asked = parser.parse_args()
    if asked.depth is not None:
        if asked.keep_heap:
            keep_heap()
        publish(asked.depth, asked.seconds)
        return
    for depth, heap in itertools.product(sorted(set(KEPT.values())), ('as it is', 'kept')):
        print(f'{depth:6d} samples, heap {heap:9s}', end='', flush=True)
        command = [sys.executable, __file__, str(asked.seconds), '--depth', str(depth)]
        subprocess.run(command + ['--keep-heap'] * (heap == 'kept'), check=True)


if __name__ == '__main__':
    main()
