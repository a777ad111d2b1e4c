"""How fast the closed loop is as a library: against real time, an earlier commit, C, and peers.

The paper's ellipse on the benchmark plant with the default regulator, one core, no ROS. All times
are taken in this one run; ours, the earlier commit's and that of the same loop plainly in C, which
is compiled here, in turn. C must fly the same trajectory. Exits with 1 when a ratio falls short.
"""

from __future__ import annotations

import argparse
import contextlib
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from earlier import EarlierLoop
from in_c import LoopInC
from peers import fly, with_control, with_mujoco, with_scipy

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import build, read_yaml
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run, warm_up
from maglev_study.references import References, ellipse

REAL_TIME_FACTOR = 100.0
SCIPY_RATIO = 30.0
C_RATIO = 1.5
EARLIER = 'f0ed2d5'
OURS, IN_C, SCIPY = 'compiled loop', 'plainly in C', 'SciPy'
SAME = 1e-9  # trajectories of the same work are at most this far apart [m, rad]
THETA = 0.010  # amplitude of the ellipse in 4DOF [rad]
BENCHMARK = Path(__file__).parents[1] / 'params' / 'benchmark.yaml'


def stage_at(references: References, **overrides: object) -> SimulatedStage:
    """The benchmark plant, moving with the reference; ``overrides`` with dots as ``__``."""
    found = read_yaml(BENCHMARK, 'plant')
    found['initial.position'] = tuple(references.position[0])
    found['initial.velocity'] = tuple(references.velocity[0])
    found |= {name.replace('__', '.'): value for name, value in overrides.items()}
    return SimulatedStage(build(PlantParameters, found))


def compiled_loop(references: References, **overrides: object) -> tuple[float, np.ndarray]:
    """Seconds the compiled loop takes, and the true outputs (n, 5)."""
    stage, regulator = stage_at(references, **overrides), Regulator(ControllerParameters())
    start = time.perf_counter()
    outcome = run(regulator, stage, references)
    return time.perf_counter() - start, np.asarray(outcome.output)


def loop_in_c(
    library: LoopInC, references: References, **overrides: object
) -> tuple[float, np.ndarray]:
    """The same in C."""
    stage, regulator = stage_at(references, **overrides), Regulator(ControllerParameters())
    start = time.perf_counter()
    state, _ = library.run(regulator, stage, references)
    return time.perf_counter() - start, state[:, ::2]


def apart_from_c(library: LoopInC, references: References) -> float:
    """How far C flies from the compiled loop at most [m, rad].

    Without counts, which turn a difference in the last bit into one of a whole count.
    """
    smooth = {'encoder__gap_resolution': 0.0, 'encoder__horizontal_resolution': 0.0}
    ours, theirs = compiled_loop(references, **smooth), loop_in_c(library, references, **smooth)
    return float(np.abs(ours[1] - theirs[1]).max())


def in_turn(references: References, library: LoopInC, times: int) -> dict[str, float]:
    """The least seconds of many runs of each, taken in turn.

    Short runs: of these some are disturbed by nothing, also on a machine that does other work.
    """
    runs: dict[str, Callable[[], float]] = {
        OURS: lambda: compiled_loop(references)[0],
        IN_C: lambda: loop_in_c(library, references)[0],
    }
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as opened:
        try:
            earlier = EarlierLoop(EARLIER, Path(folder), len(references.position))
            opened.callback(earlier.close)
            earlier.seconds()  # all is compiled
            runs[f'at {EARLIER}'] = earlier.seconds
        except OSError as error:
            print(f'nothing of {EARLIER}: {error}')
        found = [{name: one() for name, one in runs.items()} for _ in range(times)]
    return {name: min(each[name] for each in found) for name in runs}


def of_peers(references: References, samples: int) -> dict[str, float]:
    """Seconds of all the references with other integrators, from the first ``samples`` of them."""
    few = References(*(array[:samples] for array in references))
    found = {}
    for name, make in (
        (SCIPY, with_scipy),
        ('python-control', with_control),
        ('MuJoCo', with_mujoco),
    ):
        try:
            fly(make, stage_at(few), References(*(array[:2] for array in references)))
        except ImportError as error:
            print(f'nothing of {name}: {error}')
            continue
        taken, _ = fly(make, stage_at(few), few)
        found[name] = taken * len(references.position) / len(few.position)
    return found


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--duration', type=float, default=1.0, help='stage time of a run [s]')
    parser.add_argument('--peers-samples', type=int, default=300, help='that peers fly')
    parser.add_argument('--times', type=int, default=60, help='runs, of which the best counts')
    arguments = parser.parse_args()
    period = ControllerParameters().sample_time
    warm_up()
    library = LoopInC()
    references = ellipse(arguments.duration, THETA, period)
    apart = apart_from_c(library, references)
    seconds = in_turn(references, library, arguments.times)
    ours = seconds[OURS]
    seconds |= of_peers(references, arguments.peers_samples)
    by_ours = {name: value / ours for name, value in seconds.items()}
    factor = arguments.duration / ours

    print(f'real-time factor {factor:8.0f}  (at least {REAL_TIME_FACTOR:.0f})')
    for name, ratio in by_ours.items():
        print(f'{name:16}{ratio:9.2f} by ours')
    by_c = 1.0 / by_ours[IN_C]
    print(f'ours / C         {by_c:8.2f}  (at most {C_RATIO})')
    print(f'SciPy / ours     {by_ours[SCIPY]:8.0f}  (at least {SCIPY_RATIO:.0f})')
    print(f'C flies at most {apart:.1g} m or rad apart  (at most {SAME:g}; a count is 1e-05)')
    well = factor >= REAL_TIME_FACTOR and by_ours[SCIPY] >= SCIPY_RATIO
    return 0 if well and by_c <= C_RATIO and apart <= SAME else 1


if __name__ == '__main__':
    sys.exit(main())
