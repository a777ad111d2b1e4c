"""x and z are asked whether they count: what that finds, and what it costs a sound machine."""

from __future__ import annotations

import bridge_flight
import numpy as np
import pytest
from bridge_flight import Flight, hover
from rough import PARAMS

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import from_yaml, read_yaml

COULOMB = np.array((0.303, 0.171, 0.149, 1.32, 1.32))  # the default's
COUNT = 1e-5


def standing(y: float, friction: float, silence: float = 0.15) -> Flight:
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
    for _ in range(290):
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
        asked += int(np.any(flight.stage.guard.arrays.silent[4:] == 150))
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
        asked += int(np.any(flight.stage.guard.arrays.silent[4:] == 150))
    assert flight.stage.fault is None
    assert asked > 3
    assert farthest < COUNT
