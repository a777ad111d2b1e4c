"""The bridge's own share of a 1 ms sample, beside the plant's; both on this machine in this run.

Bridge: read, decode, check, commutate, write, on boards that answer at once, so without waiting and
without the emulated machine; in flight and while it lands by itself. Plant: one sample of the
simulated stage, physics included. Times are those of the processor, so that other load does not
count. Exits with 1 when the bridge's p99 is above its limit.
"""

from __future__ import annotations

import argparse
import gc
import sys
import time
from typing import Any

import numpy as np

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

LIMIT_US = 150.0
FLYING = [0.025, 0.0, 0.0, 0.0, 0.0]
HOVER = np.full(4, -0.1)


class InstantBoards(EmulatedBoards):
    """Boards whose clock has always just ticked and whose counters stand still."""

    def tick(self) -> None:
        """A sample passes at once; nothing moves."""
        self.ticks += 1
        for card in self.cards.values():
            card.on_tick()


def bridge() -> BridgeStage:
    """A bridge in flight at 25 mm on instant boards."""
    home = {'homing.at_start': True, 'homing.x': 0.0, 'homing.z': 0.0}
    parameters = build(BridgeParameters, home)
    boards = InstantBoards(parameters)
    stage = BridgeStage(parameters, driver=QuanserDriver(parameters, boards, boards.now))
    stage.configure()
    boards.rig.place(np.array(FLYING))
    boards.counters[0, :6] = boards.rig.counts()
    stage.activate()
    return stage


def samples(stage: Any, number: int) -> np.ndarray:
    """Processor time of each sample [µs]: read and write."""
    i_d, i_q = HOVER.copy(), np.zeros(4)
    times = np.empty(number)
    for k in range(number):
        start = time.thread_time_ns()
        stage.read()
        stage.write(i_d, i_q)
        times[k] = 1e-3 * (time.thread_time_ns() - start)
    return times


def main() -> int:
    """Measure, print a table, and tell by the exit code whether the limit holds."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--samples', type=int, default=20_000, help='how many (default 20000)')
    number = parser.parse_args().samples
    following, landing = bridge(), bridge()
    samples(landing, 2)
    landing.land('benchmark')
    landing.landing.arrays.descent_time = 1e6  # a descent without end
    plant = SimulatedStage(PlantParameters())
    gc.collect()
    gc.freeze()
    worst = 0.0
    print(f'{"us per sample":24}{"p50":>8}{"p99":>8}{"max":>10}')
    for name, stage in (
        ('bridge, following', following),
        ('bridge, landing', landing),
        ('plant', plant),
    ):
        samples(stage, 200)
        times = samples(stage, number)
        p50, p99 = np.percentile(times, [50, 99])
        print(f'{name:24}{p50:8.1f}{p99:8.1f}{times.max():10.1f}')
        worst = max(worst, p99 if name != 'plant' else 0.0)
    assert following.mode is Mode.FOLLOWING, following.fault
    assert landing.mode is Mode.LANDING
    print(f'bridge: p99 {worst:.1f} us, limit {LIMIT_US:g} us')
    return int(worst > LIMIT_US)


if __name__ == '__main__':
    sys.exit(main())
