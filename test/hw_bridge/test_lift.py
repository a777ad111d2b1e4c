"""What homing's lift finds out about the platen, and what encoders that are not plugged in cost."""

from __future__ import annotations

import math

import numpy as np
import pytest
from bridge_flight import Flight
from wired import bridge

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode

STOP = BridgeParameters().machine.gap_max
GRAVITY = BridgeParameters().machine.gravity
GAPS = [0, 1, 2, 3]
SOFT = 0.05  # [m/s]
RISE = 0.6  # by a millimetre [s]


def machine(heavier: float, friction: float) -> dict[str, object]:
    """A platen so many times as heavy as is believed, whose guides rub so hard along y [m/s²]."""
    coulomb = [friction, 0.171, 0.149, 1.32, 1.32]
    return {'emulation.offset.mass_y': heavier, 'emulation.guide.coulomb': coulomb}


def unhomed(heavier: float, friction: float) -> tuple[BridgeStage, EmulatedBoards]:
    dotted = machine(heavier, friction)
    overrides = {name.replace('.', '__'): value for name, value in dotted.items()}
    return bridge(homing__at_start=False, **overrides)


def homed(heavier: float, friction: float) -> BridgeStage:
    stage, _ = unhomed(heavier, friction)
    stage.configure()
    stage.home()
    return stage


def lifting_off(heavier: float, friction: float) -> Flight:
    """Active on the lower stop after homing with the lift."""
    flight = Flight(rising, {**machine(heavier, friction), 'homing.at_start': True})
    flight.stage.deactivate()
    flight.stage.home()
    flight.stage.activate()
    flight.rig.forget_impact()
    return flight


@pytest.mark.parametrize('heavier', [0.9, 1.0, 1.1])
@pytest.mark.parametrize('friction', [0.01, 0.3, 0.6])
def test_it_finds_out_what_the_platen_rises_at(heavier: float, friction: float) -> None:
    """Its weight is what it is off by, and friction, of which what creeps feels a part."""
    found = homed(heavier, friction).guard.arrays.rises_at
    balance = (1.0 - heavier) * GRAVITY
    assert balance - heavier * friction < found < balance
    if friction < 0.1:
        assert found == pytest.approx(balance, abs=0.02)


def test_homed_by_word_nobody_knows() -> None:
    stage = homed(1.0, 0.3)
    assert math.isfinite(stage.guard.arrays.rises_at)
    stage.home(vouched=True)
    assert math.isnan(stage.guard.arrays.rises_at)


@pytest.mark.parametrize('friction', [0.1, 0.6, 1.2])
@pytest.mark.parametrize('heavier', [0.9, 1.0, 1.1])
def test_gap_encoders_that_are_not_plugged_in_lift_nothing_far(
    heavier: float, friction: float
) -> None:
    """Not push by push either, where friction holds up what hardly weighs more than is carried."""
    stage, boards = unhomed(heavier, friction)
    boards.stuck[GAPS] = True
    heights = _heights(boards)
    stage.configure()
    with pytest.raises(HomingError, match='encoder gap 1, gap 2, gap 3, gap 4 did not count'):
        stage.home()
    assert min(heights) > STOP - 1e-3
    assert boards.rig.impact < SOFT
    assert not boards.lines.enabled


def _heights(boards: EmulatedBoards) -> list[float]:
    heights, tick = [STOP], boards.tick

    def watched() -> None:
        tick()
        heights.append(float(boards.rig.state[0]))

    boards.tick = watched  # type: ignore[method-assign]
    return heights


def rising(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """From the lower stop up by a millimetre: place, speed and acceleration."""
    s = min(time / RISE, 1.0)
    place, rate, bend = np.zeros(5), np.zeros(5), np.zeros(5)
    place[0] = STOP - 1e-3 * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate[0] = -1e-3 / RISE * 30.0 * s**2 * (1.0 - s) ** 2
    bend[0] = -1e-3 / RISE**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return place, rate, bend


@pytest.mark.parametrize('friction', [0.1, 0.6])
@pytest.mark.parametrize('heavier', [0.9, 1.0, 1.1])
def test_gap_encoders_that_stand_still_at_lift_off_are_missed_before_it_is_gone(
    heavier: float, friction: float
) -> None:
    """What falls back from there does so softly; without the lift it would strike either stop."""
    flight = lifting_off(heavier, friction)
    flight.boards.stuck[GAPS] = True
    flight.run(400)
    assert flight.stage.mode is Mode.DISABLED
    assert flight.stage.guard.blamed == []
    assert set(flight.stage.guard.failed) == set(GAPS)
    assert 'gap 1, gap 2, gap 3, gap 4 is stuck' in str(flight.stage.fault)
    assert 'home again' in str(flight.stage.fault)
    flight.until_no_current()
    assert flight.rig.impact < SOFT
    assert flight.rig.state[0] == STOP


@pytest.mark.parametrize('load', [0.0, 0.2])
@pytest.mark.parametrize('friction', [0.1, 0.6])
@pytest.mark.parametrize('heavier', [0.9, 1.0, 1.1])
def test_sound_ones_tell_of_it_in_time(heavier: float, friction: float, load: float) -> None:
    """Also where it carries ``load`` [kg] more than when it was homed."""
    flight = lifting_off(heavier, friction)
    watched, most = flight.stage.guard.arrays, 0.0
    watched.rises_at += load * GRAVITY / flight.stage.parameters.machine.mass_y
    for _ in range(900):
        flight.step()
        if not watched.answered.any():
            most = max(most, float(np.max(np.abs(watched.unseen[:4]))))
    assert flight.stage.mode is Mode.FOLLOWING
    assert most < 0.25 * flight.stage.parameters.fault.roll_call
