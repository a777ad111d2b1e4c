"""x and z are asked whether they count: what that finds, and what it costs a sound machine."""

from __future__ import annotations

import bridge_flight
import numpy as np
import pytest
from bridge_flight import Flight, hover
from hovering import Hover
from rough import PARAMS

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge import knock
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import build, from_yaml, read_yaml

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
    for _ in range(270):
        if flight.stage.fault is None:
            flight.run(1)
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


@pytest.mark.parametrize('seed', [1, 2])
def test_on_the_rough_machine_it_stays_within_a_count_of_the_scale(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Guides that spring, a sample of delay, windings: it is stopped later than it is seen."""
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', PARAMS / 'rough.yaml'))
    monkeypatch.setattr(bridge_flight, '_regulator', lambda: regulator)
    rough = read_yaml(PARAMS / 'rough.yaml', 'hw_bridge')
    flight = Flight(hover(0.025), {**rough, 'emulation.seed': seed})
    flight.run(500)
    asked, farthest = 0, 0.0
    for _ in range(1500):
        flight.step()
        between = flight.boards.past[flight.boards.ticks % len(flight.boards.past), 18:]
        scale = flight.stage.encoders.arrays.length[4:] + between[4:]
        farthest = max(farthest, float(np.max(np.abs(scale))))
        asked += int(np.any(flight.stage.guard.arrays.silent == 200))
    assert flight.stage.fault is None
    assert asked > 3
    assert farthest < COUNT


def knocks(friction: float) -> tuple[list[float], bool, float]:
    """How hard a platen in the middle of a count is pushed, one after another, whether in vain,
    and how far it came [m].

    ``friction`` is that of its guide, set-valued [m/s²]; 3.7 m/s² is the hardest that is tried.
    """
    asked = knock._Asked(1, 3.7, 4)
    asked.begin(1.0)
    place = rate = farthest = 0.0
    hard, lost = [], False
    while asked.under_way and not lost:
        push = asked.acceleration
        hard.append(push)
        free = rate + 1e-3 * push
        after = np.sign(free) * max(abs(free) - 1e-3 * friction, 0.0)
        before, place = place, place + 0.5e-3 * (rate + after)
        rate, farthest = float(after), max(farthest, place)
        lost = asked.go_on(round(place / COUNT) != round(before / COUNT))
    return sorted({push for push in hard if push > 0.0}), lost, farthest


def test_each_knock_is_harder_than_the_one_before_and_ends_with_the_count() -> None:
    for friction in (0.0, 0.05, 0.15, 0.35, 0.7, 1.3):
        hard, lost, farthest = knocks(friction)
        assert not lost
        assert np.allclose(np.divide(hard[1:], hard[:-1]), 1.5)
        assert hard[-1] < max(6.0 * friction, 0.6)
        assert 0.5 * COUNT < farthest < 1.6 * COUNT


def test_by_what_should_have_moved_it_two_counts_it_is_lost() -> None:
    hard, lost, farthest = knocks(4.0)
    assert lost
    assert farthest == 0.0
    assert hard == pytest.approx([3.7 / 1.5**n for n in range(6, -1, -1)])


def test_pushed_to_and_fro_it_is_where_it_was_and_stands() -> None:
    asked = knock._Asked(1, 3.7, 4)
    asked.begin(-1.0)
    pushed = []
    while asked.under_way:
        pushed.append(asked.acceleration)
        if asked.go_on(False):
            break
    assert sum(pushed) == pytest.approx(0.0)
    assert 50 < len(pushed) < 65


def test_the_push_goes_back_over_the_edge_it_passed_last() -> None:
    asking = knock.Knock(build(BridgeParameters, {}))
    watched = Hover().watched
    for way in (1.0, -1.0):
        watched.believed[4:] += way * COUNT
        watched.silent[:] = 0
        assert asking.look(watched, True) is None
        watched.silent[:] = 200
        assert asking.look(watched, True) is None
        assert [np.sign(asked.acceleration) for asked in asking._asked] == [-way, -way]
        for asked in asking._asked:
            asked.under_way = False


def test_nothing_is_asked_on_the_ground_or_with_no_current_left() -> None:
    parameters = build(BridgeParameters, {})
    asking, watched = knock.Knock(parameters), Hover().watched
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
