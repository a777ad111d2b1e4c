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
def test_a_sound_one_answers_and_the_platen_stays_within_a_count(y: float, friction: float) -> None:
    flight = standing(y, friction)
    asked, farthest = 0, 0.0
    for _ in range(1500):
        flight.step()
        assert flight.stage.fault is None
        farthest = max(farthest, float(np.max(np.abs(across(flight)))))
        asked += int(np.any(flight.stage.guard.arrays.silent == 200))
    assert asked > 0
    assert farthest < COUNT


def pushes(friction: float) -> tuple[list[float], bool]:
    """How hard a platen in the middle of a count is pushed, one after another, and whether in vain.

    ``friction`` is that of its guide, set-valued [m/s²]; 0.725 m/s² moves it a count if it is told.
    """
    asked = knock._Asked(1, 0.725, 8)
    asked.begin(1.0)
    place = rate = 0.0
    hard, lost = [], False
    while asked.under_way and not lost:
        hard.append(asked._hardness)
        push = asked.acceleration
        free = rate + 1e-3 * push
        after = np.sign(free) * max(abs(free) - 1e-3 * friction, 0.0)
        before, place = place, place + 0.5e-3 * (rate + after)
        rate = float(after)
        lost = asked.go_on(round(place / COUNT) != round(before / COUNT))
    return list(dict.fromkeys(hard)), lost


def test_it_is_pushed_softly_then_as_it_must_be_then_twice_as_hard() -> None:
    assert pushes(0.05) == ([0.3], False)
    assert pushes(0.35) == ([0.3, 1.0], False)
    assert pushes(0.9) == ([0.3, 1.0, 2.0], False)
    assert pushes(2.0) == ([0.3, 1.0, 2.0], True)


def test_what_was_enough_is_where_the_next_one_begins() -> None:
    asked = knock._Asked(1, 0.725, 8)
    begun = []
    for answers in (False, False, True, True, True):
        asked.begin(1.0)
        begun.append(asked._hardness)
        while asked.under_way:
            assert not asked.go_on(answers or asked._hardness >= 1.0)
    assert begun == pytest.approx([0.3, 0.3 / 0.81, 0.3 / 0.81**2, 0.3 / 0.81 / 0.9, 0.3 / 0.81])


def test_the_push_goes_back_over_the_edge_it_passed_last() -> None:
    asking = knock.Knock(build(BridgeParameters, {}))
    watched = standing(0.025, 1.0).stage.guard.arrays
    for way in (1.0, -1.0):
        watched.believed[4:] += way * COUNT
        watched.silent[:] = 0
        assert asking.look(watched, True) is None
        watched.silent[:] = 200
        assert asking.look(watched, True) is None
        assert [asked._sign for asked in asking._asked] == [-way, -way]
        for asked in asking._asked:
            asked.under_way = False


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
