"""How a campaign scales: machines a second on one process and on all, and the start of a worker.

The default law on machines of params/robustness.yaml, through all experiments. The two campaigns
must give equal results. Exits with 1 when the speed-up for two processes, or the start of a worker
with a warm cache, falls short.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ.setdefault(_name, '1')

from maglev_study.robustness.fleet import Plan, fly_plan, make_plan  # noqa: E402

SPEED_UP = 1.8  # of two processes
START = 2.0  # of a worker [s]
PARAMS = Path(__file__).parents[1] / 'params'
WORKER = """
from maglev_study.closed_loop import warm_up
from maglev_study.robustness import fly
warm_up()
"""


def seconds(plan: Plan, jobs: int) -> tuple[float, list[str]]:
    """How long a campaign takes [s], and what it gives."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        found = fly_plan(plan, Path(folder), jobs=jobs)
        return time.perf_counter() - start, [repr(one.to_json()) for one in found.flown]


def start_of_worker() -> float:
    """The least of three [s]."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run([sys.executable, '-c', WORKER], check=True)
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--machines', type=int, default=40)
    parser.add_argument('--jobs', type=int, default=2)
    options = parser.parse_args()
    plan = make_plan(PARAMS, options.machines)
    seconds(make_plan(PARAMS, 1), options.jobs)  # warms the cache, and starts the processes
    one, alone = seconds(plan, 1)
    many, together = seconds(plan, options.jobs)
    start = start_of_worker()
    count, ratio = options.machines + 1, one / many
    print(f'one process     {count / one:8.2f} machines a second')
    print(f'{options.jobs} processes     {count / many:8.2f} machines a second')
    print(f'speed-up        {ratio:8.2f}  (at least {SPEED_UP} for two)')
    print(f'1,000 machines  {1000 * many / count / 60.0:8.1f} min')
    print(f'start of worker {start:8.2f} s  (at most {START})')
    print(f'results         {"equal" if alone == together else "DIFFERENT"}')
    short = options.jobs == 2 and ratio < SPEED_UP
    return int(short or start > START or alone != together)


if __name__ == '__main__':
    sys.exit(main())
