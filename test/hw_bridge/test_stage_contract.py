"""One contract for every stage, simulated or on boards."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bridge_flight import HOME

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_hw_bridge.opening import open_stage
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build
from maglev_model.stage import EncoderSample, Stage
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

STAGES: dict[str, Callable[[], Any]] = {
    'plant': lambda: SimulatedStage(PlantParameters()),
    'hw_bridge': lambda: open_stage(build(BridgeParameters, HOME)),
    'hw_bridge, real time': lambda: open_stage(build(BridgeParameters, HOME), realtime=True),
}


@pytest.fixture(params=STAGES)
def stage(request: pytest.FixtureRequest) -> Any:
    made = STAGES[request.param]()
    yield made
    made.close()


def rest(sample: EncoderSample) -> None:
    assert isinstance(sample.gap, np.ndarray)
    assert (sample.gap.shape, sample.gap.dtype) == ((4,), np.float64)
    assert sample.gap == pytest.approx([0.031] * 4, abs=1e-5)
    assert (type(sample.x), type(sample.z)) == (float, float)
    assert (sample.x, sample.z) == pytest.approx((0.0, 0.0), abs=1e-5)


def test_it_rests_until_something_is_written(stage: Stage) -> None:
    rest(stage.read())
    for _ in range(10):
        stage.write(np.zeros(4), np.zeros(4))
        rest(stage.read())


def test_samples_are_its_readers_to_keep(stage: Stage) -> None:
    first = stage.read()
    first.gap[:] = 0.0
    stage.write(np.zeros(4), np.zeros(4))
    rest(stage.read())


def test_currents_lift_and_push_as_the_paper_has_it(stage: Stage) -> None:
    stage.read()
    for _ in range(25):
        stage.write(np.full(4, -1.0), np.array([0.0, -1.0, 0.0, -1.0]))
        sample = stage.read()
    assert np.all(sample.gap < 0.0305)
    assert sample.x > 1e-4
    assert abs(sample.z) < 1e-4


@pytest.mark.parametrize(
    'bad', [np.array([np.nan, 0, 0, 0]), np.array([0, 0, np.inf, 0]), np.zeros(3), np.zeros((4, 1))]
)
def test_bad_currents_are_refused(stage: Stage, bad: np.ndarray) -> None:
    stage.read()
    with pytest.raises(ValueError, match=r'finite|shape'):
        stage.write(bad, np.zeros(4))
    with pytest.raises(ValueError, match=r'finite|shape'):
        stage.write(np.zeros(4), bad)
    rest(stage.read())


def test_lists_and_integers_are_currents_too(stage: Stage) -> None:
    stage.read()
    stage.write([0, 0, 0, 0], np.zeros(4, dtype=np.float32))
    rest(stage.read())


def test_it_closes_twice(stage: Stage) -> None:
    stage.read()
    stage.close()
    stage.close()


def test_the_same_flight_on_plant_and_boards() -> None:
    """Mean tracking errors within 10 %, with the same bandwidth of the amplifiers."""
    figures = {}
    for name in ('plant', 'hw_bridge'):
        stage, regulator = STAGES[name](), Regulator(ControllerParameters())
        i_d, i_q = np.zeros(4), np.zeros(4)
        errors = []
        for k in range(4000):
            time = 1e-3 * k
            risen = min(time, 1.0)
            lift = risen**3 * (10.0 - 15.0 * risen + 6.0 * risen**2)
            angle = 4.71238898038469 * time
            wave = 0.03 * lift * np.sin([angle, angle + 1.5])
            y = 0.031 - 0.006 * lift + 0.004 * lift * np.sin(angle)
            position = np.array([y, *wave, 0.0, 0.0])
            slope = np.array([0.004, 0.03, 0.03]) * lift * 4.71238898038469
            velocity = np.zeros(5)
            velocity[:3] = slope * np.cos([angle, angle, angle + 1.5])
            regulator.step(*stage.read(), position, velocity, np.zeros(5), i_d, i_q)
            stage.write(i_d, i_q)
            errors.append(np.abs(regulator.error[:3]))
        figures[name] = np.mean(errors[2500:], axis=0)
        stage.close()
    assert figures['hw_bridge'] == pytest.approx(figures['plant'], rel=0.1)
