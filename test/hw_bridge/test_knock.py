"""x and z are asked whether they count: what that finds, and what it costs a sound machine."""

from __future__ import annotations

import numpy as np
import pytest
from bridge_flight import Flight, hover

from maglev_hw_bridge import knock
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import build

COULOMB = np.array((0.303, 0.171, 0.149, 1.32, 1.32))  # the default's
COUNT = 1e-5


def standing(y: float, friction: float, silence: float = 0.2) -> Flight:
    """Hovers at a gap [m], with so many times the default friction."""
    rubbing = {'emulation.guide.coulomb': (friction * COULOMB).tolist()}
    return Flight(hover(y), {**rubbing, 'fault.silence': silence})


def across(flight: Flight) -> np.ndarray:
    """True x and z [m]."""
    return np.array(flight.rig.state[[2, 4]])


@pytest.mark.parametrize('y', [0.019, 0.025])
@pytest.mark.parametrize('encoder', [4, 5])
def test_one_that_does_not_answer_is_landed_before_its_motors_run_away(
    encoder: int, y: float
) -> None:
    flight = standing(y, 0.3)
    flight.run(300)
    flight.boards.stuck[encoder] = True
    flight.run(270)
    assert flight.stage.fault is not None
    assert f'encoder {"xz"[encoder - 4]} is stuck' in flight.stage.fault.reason
    assert np.max(np.abs(across(flight))) < 5e-4
    assert flight.stage.mode is Mode.LANDING
    flight.rig.forget_impact()
    flight.until_no_current()
    assert flight.rig.impact < 0.05
    assert np.max(np.abs(across(flight))) < 0.01


def test_never_asked_it_runs_away_unseen() -> None:
    """Motors push off what is not where they believe it, and friction no more than slows it."""
    flight = standing(0.019, 0.3, silence=0.0)
    flight.run(300)
    flight.boards.stuck[5] = True
    flight.rig.stage.state[4] += 5e-5
    flight.run(600)
    assert np.max(np.abs(across(flight))) > 5e-3


@pytest.mark.parametrize('friction', [0.2, 1.0, 3.0])
@pytest.mark.parametrize('y', [0.019, 0.030])
def test_a_sound_one_answers_and_the_platen_stays_within_two_counts(
    y: float, friction: float
) -> None:
    flight = standing(y, friction)
    asked, farthest = 0, 0.0
    for _ in range(1500):
        flight.step()
        assert flight.stage.fault is None
        farthest = max(farthest, float(np.max(np.abs(across(flight)))))
        asked += int(np.any(flight.stage.guard.arrays.silent == 200))
    assert asked > 0
    assert farthest < 2.0 * COUNT


def test_what_the_first_push_does_not_move_the_second_does() -> None:
    flight = standing(0.025, 6.0)  # more friction than the bridge was told of
    hardness = set()
    for _ in range(1500):
        flight.step()
        hardness |= {asked._hardness for asked in flight.stage._knock._asked if asked.under_way}
    assert 2 in hardness
    assert flight.stage.fault is None


def test_nothing_is_asked_on_the_ground_or_with_no_current_left() -> None:
    parameters = build(BridgeParameters, {})
    asking = knock.Knock(parameters)
    flight = standing(0.025, 1.0)
    watched = flight.stage.guard.arrays
    flight.run(150)
    watched.silent[:] = 200
    assert asking.look(watched, False) is None
    i_d, i_q = np.zeros(4), np.zeros(4)
    watched.silent[:] = 0
    assert asking.look(watched, False) is None
    assert asking.added(watched, i_d, i_q) is i_q

    watched.silent[:] = 200
    asking.look(watched, True)
    pushed = asking.added(watched, i_d, i_q).copy()
    assert np.all(np.abs(pushed) > 0.01)
    full = np.full(4, parameters.fault.command_limit)
    assert asking.added(watched, full, i_q) is i_q
    assert asking.added(watched, i_d, i_q) is i_q, 'it went on after it could not push'


def test_a_single_motor_has_nothing_to_ask_z_with() -> None:
    single = knock.Knock(build(BridgeParameters, {'machine.motors': 1}))
    assert [asked.axis for asked in single._asked] == [1]
