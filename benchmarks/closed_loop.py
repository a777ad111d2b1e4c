"""How fast the closed loop is as a library: against real time, and against SciPy's integrator.

The paper's ellipse on the benchmark plant with the default regulator, one core, no ROS. The same
loop is run once compiled and once with ``scipy.integrate.solve_ivp`` carrying the plant from sample
to sample; both times are taken in this one run. Exits with 1 when a ratio falls short.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.compiled import compiled
from maglev_model.machine_array import machine_from_array
from maglev_model.parameters import build, read_yaml
from maglev_model.records import Block
from maglev_plant.arrays import StageArrays
from maglev_plant.dynamics import derivative
from maglev_plant.encoder import encode
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run, warm_up
from maglev_study.references import References, ellipse

REAL_TIME_FACTOR = 100.0
SCIPY_RATIO = 30.0
THETA = 0.010  # amplitude of the ellipse in 4DOF [rad]
BENCHMARK = Path(__file__).parents[1] / 'params' / 'benchmark.yaml'


def stage_at(references: References) -> SimulatedStage:
    """The benchmark plant, moving with the reference."""
    overrides = read_yaml(BENCHMARK, 'plant')
    overrides['initial.position'] = tuple(references.position[0])
    overrides['initial.velocity'] = tuple(references.velocity[0])
    return SimulatedStage(build(PlantParameters, overrides))


def compiled_loop(references: References) -> tuple[float, np.ndarray]:
    """Seconds the compiled loop takes, and the true outputs (n, 5)."""
    stage, regulator = stage_at(references), Regulator(ControllerParameters())
    start = time.perf_counter()
    outcome = run(regulator, stage, references)
    return time.perf_counter() - start, np.asarray(outcome.output)


@compiled
def state_rate(block: Block, state: np.ndarray, current: np.ndarray, rate: np.ndarray) -> None:
    """Write the rate of change of a stage's state, all (10,), with currents (8,) flowing."""
    stage: StageArrays = block[0]
    derivative(stage, machine_from_array(stage.machine), 0.0, state, current, rate)


def scipy_loop(references: References) -> tuple[float, np.ndarray]:
    """The same with an adaptive integrator, without stops and amplifier limits, not met here."""
    stage, regulator = stage_at(references), Regulator(ControllerParameters())
    arrays = stage.arrays
    period = stage.parameters.sample_time
    lag_rate = 2.0 * math.pi * stage.parameters.amplifier.bandwidth
    state, reading = arrays.state, arrays.reading
    current, target, rate = np.zeros(8), np.zeros(8), np.zeros(10)
    outputs = np.empty_like(references.position)

    def right_hand_side(elapsed: float, y: np.ndarray) -> np.ndarray:
        flowing = target + (current - target) * math.exp(-lag_rate * elapsed)
        state_rate(arrays.block, y, flowing, rate)
        return np.array(rate)

    start = time.perf_counter()
    for k, reference in enumerate(zip(*references, strict=True)):
        outputs[k] = state[::2]
        encode(arrays.block)
        regulator.step(reading[:4], reading[4], reading[5], *reference, target[:4], target[4:])
        solution = solve_ivp(right_hand_side, (0.0, period), state, rtol=1e-8, atol=1e-11)
        state[:] = solution.y[:, -1]
        current[:] = target + (current - target) * math.exp(-lag_rate * period)
    return time.perf_counter() - start, outputs


def main() -> int:
    """Measure, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--duration', type=float, default=60.0, help='stage time of the run [s]')
    parser.add_argument('--scipy-duration', type=float, default=1.0, help="and of SciPy's [s]")
    arguments = parser.parse_args()
    period = ControllerParameters().sample_time
    warm_up()
    scipy_loop(ellipse(2.0 * period, THETA, period))

    long_run = ellipse(arguments.duration, THETA, period)
    seconds = min(compiled_loop(long_run)[0] for _ in range(3)) / arguments.duration
    short_run = ellipse(arguments.scipy_duration, THETA, period)
    scipy_time, scipy_outputs = scipy_loop(short_run)
    scipy_seconds = scipy_time / arguments.scipy_duration
    apart = np.abs(scipy_outputs - compiled_loop(short_run)[1]).max()

    factor, ratio = 1.0 / seconds, scipy_seconds / seconds
    print(f'compiled loop    {seconds * period * 1e6:8.2f} us a sample')
    print(f'SciPy loop       {scipy_seconds * period * 1e6:8.2f} us a sample')
    print(f'real-time factor {factor:8.0f}  (at least {REAL_TIME_FACTOR:.0f})')
    print(f'SciPy / compiled {ratio:8.0f}  (at least {SCIPY_RATIO:.0f})')
    print(f'trajectories at most {apart:.1g} m or rad apart (a count is 1e-05 m, 1.3e-05 rad)')
    return 0 if factor >= REAL_TIME_FACTOR and ratio >= SCIPY_RATIO else 1


if __name__ == '__main__':
    sys.exit(main())
