"""Gaps are asked whether they count: what that finds, and what it costs a sound machine."""

from __future__ import annotations

import bridge_flight
import numpy as np
import pytest
from bridge_flight import Flight, hover
from rough import PARAMS

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.stage import Mode
from maglev_model.axes import FloatArray
from maglev_model.machine import machine_constants
from maglev_model.parameters import from_yaml, read_yaml
from maglev_model.platen import gaps_from_outputs

UNLIKE = {'emulation.seed': 3, 'effects.motor.spread': 0.03, 'effects.sensor.random_phase': True}
TWO = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (1, 3)]
THREE = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
ALL = (0, 1, 2, 3)


def unlike(silence: float = 0.03) -> Flight:
    """Hovers on motors that are unlike; its encoders switch at places of their own."""
    flight = Flight(hover(0.025), {**UNLIKE, 'fault.gap_silence': silence})
    flight.run(700)
    assert flight.stage.fault is None
    return flight


def gaps(flight: Flight) -> FloatArray:
    """True gaps (4,) [m]."""
    found = np.empty(4)
    machine = machine_constants(flight.stage.parameters.machine)
    gaps_from_outputs(machine, np.array(flight.rig.state[::2]), found)
    return found


@pytest.mark.parametrize('stuck', [*TWO, *THREE, ALL])
def test_those_that_do_not_answer_are_named_while_the_platen_is_where_it_was(
    stuck: tuple[int, ...],
) -> None:
    flight = unlike()
    before = gaps(flight)
    flight.boards.stuck[list(stuck)] = True
    for _ in range(300):
        if flight.stage.fault is None:
            flight.step()
    assert flight.stage.fault is not None
    names = ', '.join(f'gap {i + 1}' for i in stuck)
    assert flight.stage.fault.reason.startswith(f'encoder {names} is stuck')
    assert np.max(np.abs(gaps(flight) - before)) < 1e-4
    assert flight.stage.mode is Mode.LANDING
    flight.rig.forget_impact()
    flight.until_no_current()
    flight.run(200)
    assert flight.rig.state[0] == 0.031
    assert flight.rig.impact < (0.25 if stuck == ALL else 0.03)  # nobody sees the way down


@pytest.mark.parametrize('stuck', [THREE[0], ALL])
def test_never_asked_they_are_not_found_out_and_the_platen_wanders(stuck: tuple[int, ...]) -> None:
    flight = unlike(silence=0.0)
    before = gaps(flight)
    flight.boards.stuck[list(stuck)] = True
    for _ in range(1500):
        if flight.stage.fault is None:
            flight.step()
    assert 'stuck' not in str(flight.stage.fault)  # a sound one may be blamed at last
    assert np.max(np.abs(gaps(flight) - before)) > 3e-4


def asked_of(flight: Flight, samples: int) -> tuple[int, float, float]:
    """How often it is asked, how far y comes from its mean, and how far at rms [m]."""
    times, asked, y = 0, False, []
    for _ in range(samples):
        flight.step()
        assert flight.stage.fault is None
        under_way = flight.stage._gap_knock._pushes.under_way
        times, asked = times + int(under_way and not asked), under_way
        y.append(float(flight.rig.state[0]))
    away = np.array(y) - np.mean(y)
    return times, float(np.abs(away).max()), float(away.std())


@pytest.mark.parametrize('friction', [0.2, 1.0, 3.0])
@pytest.mark.parametrize('y', [0.019, 0.030])
def test_sound_ones_answer_and_are_asked_ever_less(y: float, friction: float) -> None:
    coulomb = friction * np.array((0.303, 0.171, 0.149, 1.32, 1.32))
    flight = Flight(hover(y), {**UNLIKE, 'emulation.guide.coulomb': coulomb.tolist()})
    flight.run(300)
    first, farthest, _ = asked_of(flight, 1500)
    assert 0 < first <= 6
    assert farthest < 1.8e-5
    later, farthest, rms = asked_of(flight, 3000)
    assert later <= 5
    assert farthest < 1.8e-5
    assert rms < 5e-6


@pytest.mark.parametrize('seed', [1, 2])
@pytest.mark.parametrize('friction', ['lugre', 'coulomb', 'tanh'])
def test_sound_ones_of_the_rough_machine_answer(
    seed: int, friction: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    regulator = Regulator(from_yaml(ControllerParameters, 'controller', PARAMS / 'rough.yaml'))
    monkeypatch.setattr(bridge_flight, '_regulator', lambda: regulator)
    rough = read_yaml(PARAMS / 'rough.yaml', 'hw_bridge')
    overrides = {**rough, 'emulation.seed': seed, 'effects.friction.model': friction}
    flight = Flight(hover(0.0223), overrides)
    flight.run(500)
    times, farthest, rms = asked_of(flight, 2500)
    assert times <= 9
    assert farthest < 2e-5
    assert rms < 4e-6
