"""What the whole graph costs: lockstep tick against a bare echo, start-up, memory.

Runs bare echoes between two rclpy processes and the ellipse scenario (plant, controller, reference,
monitor, recorder) in turn, so that a drifting machine drifts for both, and prints the ratio of the
median tick to the median round trip round by round. Use it with the environment of ``setup.sh``::

    source setup.sh && python benchmarks/graph.py
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

import numpy as np

from maglev_monitor.bag.reader import Bag

ROOT = Path(__file__).parents[1]
LEVITATING = 0.0309  # the platen is off its stop below this gap [m]
LARGEST_RATIO, LEAST_FACTOR, LONGEST_START, MOST_MEMORY = 1.8, 2.5, 5.0, 250.0


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


class Memory(threading.Thread):
    """Watches the largest resident memory of each node [MB]."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.peak: dict[str, float] = {}
        self.over = threading.Event()

    def run(self) -> None:
        """Look until ``over`` is set."""
        while not self.over.wait(0.2):
            for entry in Path('/proc').glob('[0-9]*'):
                try:
                    words = (entry / 'cmdline').read_bytes().decode().split('\0')
                    status = (entry / 'status').read_text()
                except (OSError, UnicodeDecodeError):
                    continue
                node = [Path(word).name for word in words if f'{ROOT}/install/maglev_' in word]
                peak = [line.split()[1] for line in status.splitlines() if 'VmHWM' in line]
                if node and peak and node[0] != 'analyze':
                    self.peak[node[0]] = max(self.peak.get(node[0], 0.0), int(peak[0]) / 1024)


def levitating_at(bag: Path) -> float:
    """Wall clock of the first sample that levitates [s since the epoch]."""
    for batch in Bag(bag).batches():
        states = batch.samples.get('plant')
        if states is None:
            continue
        flying = np.nonzero(states['state'][:, 0] < LEVITATING)[0]
        if len(flying):
            first = states[flying[0]]
            return float(first['seconds']) + 1e-9 * float(first['nanoseconds'])
    raise SystemExit('graph: the platen never levitated')


def scenario(folder: Path, duration: float, *options: str) -> tuple[float, float, float]:
    """Run the ellipse: median tick [s], real-time factor, time until it levitates [s]."""
    began = time.time()
    called = [str(ROOT / 'scenarios' / 'ellipse.sh'), *options]
    done = subprocess.run(
        [*called, '--duration', str(duration), '--out', folder],
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SystemExit(f'graph: the scenario failed:\n{done.stdout}{done.stderr}')
    timing = json.loads((folder / 'metrics.json').read_text())['timing']
    start = levitating_at(folder / 'bag') - began
    return timing['tick_p50'], timing['real_time_factor'], start


def main() -> int:
    """Print the figures; 1 when one falls short."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--duration', type=float, default=15.0, help='measured time of a run [s]')
    options = parser.parse_args()
    memory = Memory()
    memory.start()
    rows = []
    for number in range(options.rounds):
        default, events = round_trip('default', 3.0), round_trip('events', 3.0)
        with tempfile.TemporaryDirectory() as folder:
            tick, factor, start = scenario(Path(folder) / 'run', options.duration)
        rows.append((tick / default, tick / events, factor, start))
        print(
            f'round {number + 1}: tick {tick * 1e6:.0f} us, bare echo {default * 1e6:.0f} us'
            f' (default executor), {events * 1e6:.0f} us (events executor);'
            f' {factor:.2f} x real time, levitates after {start:.1f} s',
            flush=True,
        )
    memory.over.set()
    by_default, by_events, factor, start = (
        statistics.median(row) for row in zip(*rows, strict=True)
    )
    print(f'tick / bare echo, rclpy default executor: {by_default:.2f}')
    print(f'tick / bare echo, EventsExecutor:         {by_events:.2f}')
    print(f'real-time factor: {factor:.2f}, from command to levitation: {start:.1f} s')
    print('peak memory [MB]: ' + ', '.join(f'{n} {mb:.0f}' for n, mb in memory.peak.items()))
    kept = (
        min(by_default, by_events) <= LARGEST_RATIO
        and factor >= LEAST_FACTOR
        and start <= LONGEST_START
        and max(memory.peak.values()) <= MOST_MEMORY
    )
    return 0 if kept else 1


if __name__ == '__main__':
    sys.exit(main())
