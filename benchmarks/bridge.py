"""The bridge's own share of a 1 ms sample, beside the plant's; both on this machine in this run.

Bridge: read, decode, check, commutate, write, in flight and while it lands by itself, on emulated
boards whose machine is not counted. Plant: one sample of the simulated stage, physics included.
Times are those of the processor, so that other load does not count. Exits with 1 when the bridge's
p99 is above its limit.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import Stage
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

LIMIT_US = 150.0
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


class UncountedBoards(EmulatedBoards):
    """Boards that tell how long the machine behind them has taken."""

    taken = 0
    """Processor time [ns]."""

    def tick(self) -> None:
        """A sample passes."""
        start = time.thread_time_ns()
        super().tick()
        self.taken += time.thread_time_ns() - start


def bridge() -> tuple[BridgeStage, UncountedBoards]:
    """A bridge in flight at 25 mm, and its boards."""
    home = {'homing.at_start': True, 'homing.x': 0.0, 'homing.z': 0.0}
    parameters = build(BridgeParameters, home)
    boards = UncountedBoards(parameters)
    stage = BridgeStage(parameters, driver=QuanserDriver(parameters, boards, boards.now))
    stage.configure()
    boards.rig.place(HOVER)
    stage.activate()
    return stage, boards


def samples(stage: Stage, number: int, boards: UncountedBoards | None = None) -> np.ndarray:
    """Processor time of each sample [µs]: read and write, less what the boards' machine takes.

    Between the two the default law answers, which does not count either.
    """
    regulator, rest = Regulator(ControllerParameters()), np.zeros(5)
    i_d, i_q = np.zeros(4), np.zeros(4)
    times = np.empty(number)
    for k in range(number):
        before = boards.taken if boards else 0
        start = time.thread_time_ns()
        sample = stage.read()
        spent = time.thread_time_ns() - start
        regulator.step(*sample, HOVER, rest, rest, i_d, i_q)
        start = time.thread_time_ns()
        stage.write(i_d, i_q)
        spent += time.thread_time_ns() - start
        times[k] = 1e-3 * (spent - (boards.taken - before if boards else 0))
    return times


def main() -> int:
    """Measure, print a table, and tell by the exit code whether the limit holds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--samples', type=int, default=20_000, help='how many (default 20000)')
    number = parser.parse_args().samples
    (following, flown), (landing, landed) = bridge(), bridge()
    samples(landing, 200, landed)
    landing.land('benchmark')
    landing.landing.arrays.descent_time = 1e6  # a descent without end
    place = {'initial.position': tuple(HOVER)}
    plant = SimulatedStage(build(PlantParameters, place))
    gc.collect()
    gc.freeze()
    worst = 0.0
    print(f'{"us per sample":24}{"p50":>8}{"p99":>8}{"max":>10}')
    for name, stage, boards in (
        ('bridge, following', following, flown),
        ('bridge, landing', landing, landed),
        ('plant', plant, None),
    ):
        times = samples(stage, 200 + number, boards)[200:]
        p50, p99 = np.percentile(times, [50, 99])
        print(f'{name:24}{p50:8.1f}{p99:8.1f}{times.max():10.1f}')
        worst = max(worst, p99 if name != 'plant' else 0.0)
    assert following.mode is Mode.FOLLOWING, following.fault
    assert landing.mode is Mode.LANDING
    print(f'bridge: p99 {worst:.1f} us, limit {LIMIT_US:g} us')
    return int(worst > LIMIT_US)


if __name__ == '__main__':
    sys.exit(main())
