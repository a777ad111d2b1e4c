"""How cost grows: with samples, machines, harmonics and the length of a bag; in time and memory.

The compiled closed loop against the samples of a flight, the machines of a batch and the harmonics
of the internal model; ``analyze`` against the length of a bag, in time and in memory; and the
memory of what writes a bag, while it takes the messages of an hour faster than real time. The bags
lie in a temporary folder, some 2 GB with the longest. Time is the processor's, so that a machine
with other work disturbs little. Of a cost that may have a constant part, the exponent is that of
what it has beyond its smallest: 1 is linear. Exits with 1 where one grows worse than it should.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

for _name in ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS'):
    os.environ.setdefault(_name, '1')

import matplotlib  # noqa: E402

matplotlib.use('Agg')

import numpy as np  # noqa: E402
from matplotlib import pyplot as plt  # noqa: E402
from matplotlib.axes import Axes  # noqa: E402

from maglev_controller.parameters import ControllerParameters  # noqa: E402
from maglev_controller.regulator import Regulator  # noqa: E402
from maglev_model.axes import AXES  # noqa: E402
from maglev_model.parameters import build  # noqa: E402
from maglev_plant.parameters import PlantParameters  # noqa: E402
from maglev_plant.simulation import SimulatedStage  # noqa: E402
from maglev_study.closed_loop import run, warm_up  # noqa: E402
from maglev_study.library import batch  # noqa: E402
from maglev_study.references import ellipse  # noqa: E402

LINEAR = 1.3  # exponent, with room for what disturbs a measurement; a square is above 1.8
CONSTANT = 0.05  # exponent of a memory, constant part and all
PEAK = 500.0  # of the analysis of the longest bag [MB]
LEAK = 1.0  # of what writes a bag [MB/h]
HOUR = 3_600_000  # samples
MACHINES = (1, 3, 6, 12, 24)
HARMONICS = (1, 10, 20, 30, 40)
WRITER = Path(__file__).parents[1] / 'test' / 'support' / 'long_run.py'
ANALYSIS = """
import sys, time
from pathlib import Path
from maglev_monitor.report.analyze_cli import analyze
code = analyze(sys.argv[1:])
peak = next(line for line in Path('/proc/self/status').open() if line.startswith('VmHWM'))
print(time.process_time(), int(peak.split()[1]) * 1.024e-3)
sys.exit(code)
"""


class Growth(NamedTuple):
    """A cost in ``unit`` by how many there are of ``what``, and what it is judged by."""

    name: str
    what: str
    unit: str
    sizes: Sequence[float]
    costs: Sequence[float]
    figure: str
    value: float
    limit: float

    @property
    def kept(self) -> bool:
        """Whether it grows as it should."""
        return self.value <= self.limit


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """Of the power by which a cost beyond that of the first, smallest size grows.

    Fitted to logarithms, of which the least costs have the largest errors.
    """
    beyond = np.diff(np.stack([sizes, costs]))  # in steps, so that none is below 0 for noise alone
    more, cost = np.cumsum(np.maximum(beyond, 1e-12), axis=1)
    return float(np.polyfit(np.log(more), np.log(cost), 1, w=cost)[0])


def linear(
    name: str, what: str, unit: str, sizes: Sequence[float], costs: Sequence[float]
) -> Growth:
    """A cost that may grow as fast as the size."""
    return Growth(name, what, unit, sizes, costs, 'exponent', exponent(sizes, costs), LINEAR)


def constant(name: str, what: str, sizes: Sequence[float], peaks: Sequence[float]) -> Growth:
    """A memory [MB] that may not grow."""
    power = float(np.polyfit(np.log(sizes), np.log(peaks), 1)[0])
    return Growth(name, what, 'MB', sizes, peaks, 'exponent', power, CONSTANT)


def leak(minutes: np.ndarray, memory: np.ndarray) -> float:
    """By how much the most of the second half is above that of the first, by its time [MB/h].

    Within a file of a bag, of eleven minutes, its writer's memory rises.
    """
    half = len(memory) // 2
    hours = (minutes[-1] - minutes[half - 1]) / 60.0
    return float((memory[half:].max() - memory[:half].max()) / hours)


def processor_times(runs: Iterable[Callable[[], object]], times: int) -> list[float]:
    """The least of many runs of each, taken in turn [s]."""
    runs = list(runs)
    found = []
    for _ in range(times):
        for one in runs:
            start = time.process_time()
            one()
            found.append(time.process_time() - start)
    return [min(found[place :: len(runs)]) for place in range(len(runs))]


def flight(samples: int, harmonics: int = 5) -> Callable[[], object]:
    """The 4DOF ellipse on the benchmark plant, ready to be flown."""
    models = {f'{axis}.multiples': tuple(map(float, range(harmonics + 1))) for axis in AXES}
    table = build(ControllerParameters, models)
    references = ellipse(samples * table.sample_time, 0.010, table.sample_time)
    regulator = Regulator(table)
    plant = {
        'initial.position': tuple(references.position[0]),
        'initial.velocity': tuple(references.velocity[0]),
    }

    def fly() -> None:
        regulator.reset()
        run(regulator, SimulatedStage(build(PlantParameters, plant)), references)

    return fly


def of_samples(quick: bool) -> Growth:
    """The compiled closed loop, by the length of a flight."""
    sizes = [share * (2000 if quick else 4000) for share in (1, 2, 4, 8, 16)]
    costs = processor_times([flight(size) for size in sizes], 20)
    return linear('closed loop', 'samples', 's', sizes, costs)


def of_harmonics(quick: bool) -> Growth:
    """The same by the order of the internal models; short flights, which little disturbs."""
    samples = 2000
    costs = processor_times([flight(samples, count) for count in HARMONICS], 50 if quick else 150)
    times = [1e6 * cost / samples for cost in costs]
    return linear('closed loop', 'harmonics', 'µs a sample', HARMONICS, times)


def of_machines(quick: bool) -> Growth:
    """A batch in one process, by how many machines fly."""
    duration = 0.5 if quick else 3.0
    drawn = np.random.default_rng(3).uniform(0.97, 1.03, MACHINES[-1])
    machines = [{'offset.mass_y': float(mass)} for mass in drawn]

    def fly(count: int) -> Callable[[], object]:
        return lambda: batch(machines[:count], 'ellipse', duration=duration, jobs=1)

    costs = processor_times([fly(count) for count in MACHINES], 3)
    return linear('batch', 'machines', 's', MACHINES, costs)


def written(bag: Path, samples: int) -> np.ndarray:
    """Write a bag; samples written and memory of its writer [MB] second by second, (2, n).

    Without Python's arenas: of these there is one more or one less now and then, a megabyte each.
    """
    command = [sys.executable, str(WRITER), str(bag), str(samples)]
    plain = {**os.environ, 'PYTHONMALLOC': 'malloc'}
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=plain)
    return np.loadtxt(done.stdout.splitlines(), unpack=True)


def analysed(folder: Path) -> tuple[float, float]:
    """Processor time [s] and peak memory [MB] of an analysis, whose run must pass."""
    command = [sys.executable, '-c', ANALYSIS, str(folder)]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
    seconds, peak = done.stdout.splitlines()[-1].split()
    return float(seconds), float(peak)


def of_bags(quick: bool) -> list[Growth]:
    """Bags of more and more samples: their analysis, and the writing of the longest."""
    longest = HOUR * 2 // 5 if quick else HOUR
    sizes = [longest // share for share in (27, 9, 3, 1)]
    found = []
    for samples in sizes:
        with tempfile.TemporaryDirectory() as folder:
            needed = 600 * samples  # bytes
            if shutil.disk_usage(folder).free < 2 * needed:
                raise SystemExit(f'growth: {folder} has no room for a bag of {needed / 1e9:.0f} GB')
            memory = written(Path(folder) / 'bag', samples)
            found.append(analysed(Path(folder)))
    seconds, peaks = zip(*found, strict=True)
    minutes = [samples / 60_000 for samples in sizes]
    times, memory = memory[0] / 60_000, memory[1]
    return [
        linear('analyze', 'minutes', 's', minutes, seconds),
        constant('analyze', 'minutes', minutes, peaks),
        Growth('recorder', 'minutes', 'MB', times, memory, 'MB/h', leak(times, memory), LEAK),
    ]


def draw(growths: Sequence[Growth], path: Path) -> None:
    """All of them in one picture."""
    figure, axes = plt.subplots(2, 3, figsize=(12.0, 6.5), layout='constrained')
    for panel, growth in zip(axes.flat, growths, strict=True):
        _panel(panel, growth)
    figure.savefig(path, dpi=120)


def _panel(panel: Axes, growth: Growth) -> None:
    panel.plot(growth.sizes, growth.costs, '.-' if len(growth.sizes) < 20 else '-')
    panel.set_title(f'{growth.name}: {growth.value:.2f} {growth.figure}, at most {growth.limit:g}')
    panel.set_xlabel(growth.what)
    panel.set_ylabel(growth.unit)
    panel.set_xlim(0.0, 1.05 * max(growth.sizes))
    panel.set_ylim(0.0, 1.1 * max(growth.costs))
    panel.locator_params(axis='x', nbins=5)
    panel.grid(alpha=0.3)


def line(growth: Growth) -> str:
    """A row of the table."""
    costs = f'{growth.costs[0]:.4g} to {growth.costs[-1]:.4g} {growth.unit}'
    sizes = f'{growth.sizes[0]:.4g} to {growth.sizes[-1]:.4g} {growth.what}'
    verdict = f'{growth.value:6.2f} {growth.figure} (at most {growth.limit:g})'
    short = '' if growth.kept else '  FALLS SHORT'
    return f'{growth.name:12} {sizes:24} {costs:30} {verdict}{short}'


def main() -> int:
    """Measure, print, draw, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--quick', action='store_true', help='short flights, a bag of 24 min')
    parser.add_argument('--out', type=Path, metavar='DIR', help='where growth.png goes')
    arguments = parser.parse_args()
    warm_up()
    growths = []
    for measure in (of_samples, of_machines, of_harmonics):
        growths.append(measure(arguments.quick))
        print(line(growths[-1]), flush=True)
    for growth in of_bags(arguments.quick):
        growths.append(growth)
        print(line(growth), flush=True)
    peak, most, slope = max(growths[-2].costs), max(growths[-1].costs), growths[-1].value
    print(f'the longest analysis takes {peak:.0f} MB (at most {PEAK:g})')
    print(f'what writes a bag has {most + 24.0 * max(slope, 0.0):.0f} MB after 24 h')
    if arguments.out:
        arguments.out.mkdir(parents=True, exist_ok=True)
        draw(growths, arguments.out / 'growth.png')
    return 0 if peak <= PEAK and all(growth.kept for growth in growths) else 1


if __name__ == '__main__':
    sys.exit(main())
