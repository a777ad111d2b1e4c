"""At what speed the platen meets its stop: landed by the bridge, and with the current cut.

On emulated boards, from several heights at rest and from the paper's ellipse in 4DOF at full speed,
also with one encoder that jumps by a millimetre. "foretold" is what the bridge itself computes at a
cut, without guide friction; near 28.7 mm, where weight and magnets balance, that decides between
the stops. Exits with 1 when a landing is not soft.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np

from maglev_hw_bridge.drivers.emulated import EmulatedDriver
from maglev_hw_bridge.landing import impact_of_cut
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.currents import exact_currents
from maglev_model.inverse import CurrentLimits
from maglev_model.machine import machine_constants
from maglev_model.parameters import build
from maglev_study.references import References, ellipse_at

SOFT = 0.05  # [m/s]
HEIGHTS = (0.019, 0.020, 0.0225, 0.025, 0.0275, 0.0285, 0.030)  # air gap [m]
LIMITS = CurrentLimits(7.0, 1.0, 0.0)
_JUMP = 100  # counts
THETA = 0.010  # amplitude of the ellipse in 4DOF [rad]


def airborne(motion: References) -> tuple[BridgeStage, EmulatedDriver]:
    """A bridge whose platen is in that motion."""
    position, velocity, acceleration = motion
    home = {'homing.at_start': True, 'homing.x': 0.0, 'homing.z': 0.0}
    stage = BridgeStage.ready(build(BridgeParameters, home))
    driver = stage.driver
    assert isinstance(driver, EmulatedDriver)
    stage.deactivate()
    driver.boards.place(position, velocity)
    stage.activate()
    machine = machine_constants(stage.parameters.machine)
    for _ in range(8):
        stage.read()
        position = stage.guard.arrays.position
        i_d, i_q, _ = exact_currents(machine, position[None], acceleration[None], LIMITS)
        stage.write(i_d[0], i_q[0])
    stage.read()
    driver.boards.rig.forget_impact()
    return stage, driver


def landed(motion: References, jumping: int | None = None) -> float:
    """Speed at the stop when the bridge lands because it must, or an encoder (0..5) jumps [m/s]."""
    stage, driver = airborne(motion)
    if jumping is None:
        stage.land('benchmark')
    else:
        driver.boards.jumps[jumping] += _JUMP
        stage.hold()
        stage.read()
        assert stage.mode is Mode.LANDING, stage.fault
    while stage.mode is Mode.LANDING:
        stage.hold()
        stage.read()
    for _ in range(300):
        stage.hold()
        stage.read()
    assert stage.fault is None or not stage.fault.cut, stage.fault
    return driver.boards.rig.impact


def cut(motion: References) -> tuple[float, float, str]:
    """Speed at the stop when the current is cut: as it is, as foretold [m/s]; which stop."""
    stage, driver = airborne(motion)
    watched = stage.guard.arrays
    foretold, stop = impact_of_cut(stage.parameters, watched.position[0], watched.rate[0])
    stage.deactivate()
    for _ in range(3000):
        driver.boards.tick()
    return driver.boards.rig.impact, foretold, stop


def main() -> int:
    """Print the table; tell by the exit code whether every landing was soft."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    still = np.zeros(5)
    places: list[tuple[str, References]] = [
        (
            f'at rest, y = {y * 1e3:.1f} mm',
            References(np.array([y, 0.0, 0.0, 0.0, 0.0]), still, still),
        )
        for y in HEIGHTS
    ]
    for degrees in range(0, 360, 45):
        places.append((f'on the ellipse, {degrees} deg', ellipse_at(math.radians(degrees), THETA)))
    worst = 0.0
    print(f'{"m/s at the stop":26}{"landed":>8}{"cut":>8}{"foretold":>10}  stop')
    for name, motion in places:
        soft = landed(motion)
        hard, foretold, stop = cut(motion)
        worst = max(worst, soft)
        print(f'{name:26}{soft:8.3f}{hard:8.2f}{foretold:10.2f}  {stop}')
    for encoder, name in enumerate(ENCODER_NAMES):
        soft = max(
            landed(ellipse_at(math.radians(degrees), THETA), encoder)
            for degrees in range(0, 360, 45)
        )
        worst = max(worst, soft)
        print(f'{f"on the ellipse, {name} jumps":26}{soft:8.3f}')
    print(f'landed: {worst:.3f} m/s at most, limit {SOFT:g} m/s')
    return int(worst > SOFT)


if __name__ == '__main__':
    sys.exit(main())
