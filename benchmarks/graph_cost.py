"""What the whole graph costs: lockstep tick against a bare echo, CPU time, start-up, memory.

Runs bare echoes between two rclpy processes, the graph's messages without what makes them
(``skeleton.py``) and the ellipse scenario (plant, controller, reference, monitor, recorder) in
turn, so that a drifting machine drifts for all, and prints the ratio of the median tick to the
other medians round by round. Use it with the environment of ``setup.sh``::

    source setup.sh && python benchmarks/graph_cost.py
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import skeleton

from maglev_model.axes import FloatArray
from maglev_monitor.bag.reader import Bag

ROOT = Path(__file__).parents[1]
LEVITATING = 0.0309  # the platen is off its stop below this gap [m]
LARGEST_RATIO, LEAST_FACTOR, LONGEST_START, MOST_MEMORY = 1.3, 2.5, 5.0, 250.0
LARGEST_OF_SKELETON = 1.6


def round_trip(executor: str, seconds: float) -> float:
    """Median round trip of a bare echo [s]."""
    script = str(Path(__file__).with_name('echo.py'))
    server = subprocess.Popen([sys.executable, script, 'answer', executor])
    try:
        asked = subprocess.run(
            [sys.executable, script, 'ask', executor, str(seconds)],
            check=True,
            capture_output=True,
            text=True,
        )
    finally:
        server.kill()
        server.wait()
    return float(asked.stdout)


class Watch(threading.Thread):
    """Watches each node's largest memory [MB], and its CPU time [s] as it goes."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.peak: dict[str, float] = {}  # resident
        self.share: dict[str, float] = {}  # what several have counted in parts
        self.spent: dict[str, list[tuple[float, float]]] = {}  # wall clock and CPU time
        self.over = threading.Event()

    def run(self) -> None:
        """Look until ``over`` is set."""
        looks = 0
        while not self.over.wait(0.2):
            looks += 1
            for entry in Path('/proc').glob('[0-9]*'):
                try:
                    words = (entry / 'cmdline').read_bytes().decode().split('\0')
                    status = (entry / 'status').read_text()
                    tasks = [task.read_text() for task in entry.glob('task/*/schedstat')]
                    node = [Path(word).name for word in words if f'{ROOT}/install/maglev_' in word]
                    seldom = looks % 10 == 0  # it walks all pages of a node
                    rollup = (entry / 'smaps_rollup').read_text() if node and seldom else ''
                except (OSError, UnicodeDecodeError):
                    continue
                if node and node[0] != 'analyze':
                    self._most(self.peak, node[0], status, 'VmHWM:')
                    self._most(self.share, node[0], rollup, 'Pss:')
                    spent = 1e-9 * sum(int(task.split()[0]) for task in tasks)
                    self.spent.setdefault(node[0], []).append((time.time(), spent))

    def _most(self, most: dict[str, float], node: str, text: str, name: str) -> None:
        for line in text.splitlines():
            if line.startswith(name):
                most[node] = max(most.get(node, 0.0), int(line.split()[1]) / 1024)

    def by_tick(self, clock: FloatArray) -> dict[str, float]:
        """CPU time of each node in a tick [s], of the ticks at ``clock`` (n,) [s since the epoch].

        From the middle eight tenths of them: nodes start, and end, beside the others.
        """
        first, last = np.quantile(clock, (0.1, 0.9))
        ticks = np.count_nonzero((clock >= first) & (clock < last))
        used = {}
        for node, spent in self.spent.items():
            when, sums = np.array(spent).T
            if when[0] <= first and when[-1] >= last:
                used[node] = float(np.interp(last, when, sums) - np.interp(first, when, sums))
        return {node: seconds / ticks for node, seconds in used.items()}

    def until(self, moment: float) -> dict[str, float]:
        """CPU time of each node by then [s]; ``moment`` [s since the epoch]."""
        return {
            node: float(np.interp(moment, *np.array(spent).T))
            for node, spent in self.spent.items()
            if spent[0][0] < moment
        }


def flown(bag: Path) -> tuple[FloatArray, float]:
    """Wall clock of every sample [s since the epoch], and of the first that levitates."""
    parts: dict[str, list[Any]] = {'plant': [], 'measurement': []}
    for batch in Bag(bag).batches():
        for topic, found in parts.items():
            if topic in batch.samples:
                found.append(batch.samples[topic])
    states, read = (np.concatenate(found) for found in parts.values())
    flying = states['sequence'][states['state'][:, 0] < LEVITATING]
    if len(flying) == 0:
        raise SystemExit('graph: the platen never levitated')
    clock = 1e-9 * read['wall_time']
    return clock, float(clock[np.searchsorted(read['sequence'], flying[0])])


class Flown(NamedTuple):
    """What a run of the ellipse took [s]."""

    tick: float  # median
    factor: float  # real-time factor
    start: float  # until it levitates
    starting: dict[str, float]  # by node, CPU time until then
    spent: dict[str, float]  # by node, CPU time in a tick


def scenario(folder: Path, duration: float, watch: Watch, *options: str) -> Flown:
    """Run the ellipse, with options of its script."""
    watch.spent.clear()
    began = time.time()
    called = [str(ROOT / 'scenarios' / 'ellipse.sh')]
    done = subprocess.run(
        [*called, '--duration', str(duration), '--out', str(folder), *options],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SystemExit(f'graph: the scenario failed:\n{done.stdout}{done.stderr}')
    timing = json.loads((folder / 'metrics.json').read_text())['timing']
    clock, levitates = flown(folder / 'bag')
    return Flown(
        timing['tick_p50'],
        timing['real_time_factor'],
        levitates - began,
        watch.until(levitates),
        watch.by_tick(clock),
    )


def _by_node(rounds: list[dict[str, float]], scale: float) -> str:
    nodes = {node: [one[node] for one in rounds if node in one] for one in rounds for node in one}
    middle = {node: scale * statistics.median(times) for node, times in nodes.items()}
    middle['all'] = sum(middle.values())
    return ', '.join(f'{node} {time:.0f}' for node, time in middle.items() if time >= 0.5)


def main() -> int:
    """Print the figures; 1 when one falls short."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--duration', type=float, default=15.0, help='measured time of a run [s]')
    options = parser.parse_args()
    watch = Watch()
    watch.start()
    rows, runs = [], []
    for number in range(options.rounds):
        default, events = round_trip('default', 3.0), round_trip('events', 3.0)
        bones = skeleton.tick(4.0)
        with tempfile.TemporaryDirectory() as folder:
            run = scenario(Path(folder) / 'run', options.duration, watch)
        rows.append(
            (run.tick / default, run.tick / events, run.tick / bones, run.factor, run.start)
        )
        runs.append(run)
        print(
            f'round {number + 1}: tick {run.tick * 1e6:.0f} us, bare echo {default * 1e6:.0f} us'
            f' (default executor), {events * 1e6:.0f} us (events executor),'
            f' skeleton {bones * 1e6:.0f} us;'
            f' {run.factor:.2f} x real time, levitates after {run.start:.1f} s',
            flush=True,
        )
    watch.over.set()
    by_default, by_events, by_bones, factor, start = (
        statistics.median(row) for row in zip(*rows, strict=True)
    )
    print(f'tick / bare echo, rclpy default executor: {by_default:.2f}')
    print(f'tick / bare echo, EventsExecutor:         {by_events:.2f}')
    print(f'tick / skeleton:                          {by_bones:.2f}')
    print(f'real-time factor: {factor:.2f}, from command to levitation: {start:.1f} s')
    starting, spent = [run.starting for run in runs], [run.spent for run in runs]
    print('CPU time until it levitates [ms]: ' + _by_node(starting, 1e3))
    print('CPU time in a tick [us]: ' + _by_node(spent, 1e6))
    for name, memory in (('resident', watch.peak), ('with shared pages in parts', watch.share)):
        by_node = ', '.join(f'{node} {size:.0f}' for node, size in memory.items())
        print(f'peak memory, {name} [MB]: {by_node}')
    kept = (
        min(by_default, by_events) <= LARGEST_RATIO
        and by_bones <= LARGEST_OF_SKELETON
        and factor >= LEAST_FACTOR
        and start <= LONGEST_START
        and max(watch.peak.values()) <= MOST_MEMORY
    )
    return 0 if kept else 1


if __name__ == '__main__':
    sys.exit(main())
