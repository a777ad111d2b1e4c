"""What the views cost a flight in lockstep: the ellipse with none, with each, and all watched.

Flies them in turn, so that a drifting machine drifts for all, and prints the real-time factor of
each over that without a view, of the same round. Use it with the environment of ``setup.sh``::

    MAGLEV_SETUP=view source setup.sh && python benchmarks/view.py
"""

from __future__ import annotations

import argparse
import contextlib
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from graph_cost import Watch, scenario

WATCHER = """
import rclpy
from rclpy.executors import SingleThreadedExecutor
from maglev_view.node import NEEDS
rclpy.init()
node = rclpy.create_node('watcher')
taken = [node.create_subscription(kind, t, lambda m: None, 10) for t, (kind, _) in NEEDS.items()]
executor = SingleThreadedExecutor()
executor.add_node(node)
while True:
    executor.spin_once(1.0)
"""
LEAST_RATIO = 0.9
"""Of the real-time factor with the views that every flight has."""


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """Somebody who subscribes to all standard topics."""
    watcher = subprocess.Popen(['nice', '-n', '10', sys.executable, '-c', WATCHER])
    try:
        yield
    finally:
        watcher.kill()
        watcher.wait()


CASES = {
    'no view': (('--no-view',), False),
    'view, nobody subscribes': ((), False),
    'view, all subscribed': ((), True),
    'view and web': (('--view',), False),
}


def main() -> int:
    """Print the figures; 1 when one falls short."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument(
        '--duration',
        type=float,
        default=30.0,
        help='measured time of a run [s]; in a short one the start of the views counts',
    )
    options = parser.parse_args()
    watch = Watch()
    watch.start()
    factors: dict[str, list[float]] = {name: [] for name in CASES}
    for number in range(options.rounds):
        for name, (given, seen) in CASES.items():
            with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as around:
                if seen:
                    around.enter_context(watched())
                run = scenario(Path(folder) / 'run', options.duration, watch, *given)
            factors[name].append(run.factor)
            print(f'round {number + 1}: {name}: {run.factor:.2f} x real time', flush=True)
    ratios = {
        name: statistics.median(a / b for a, b in zip(found, factors['no view'], strict=True))
        for name, found in factors.items()
    }
    for name, ratio in ratios.items():
        print(f'{name}: {ratio:.2f} of the speed without a view')
    return 0 if ratios['view, nobody subscribes'] >= LEAST_RATIO else 1


if __name__ == '__main__':
    sys.exit(main())
