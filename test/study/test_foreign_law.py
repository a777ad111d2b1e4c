"""Laws that are objects of one's own in the closed loop as a library."""

from __future__ import annotations

import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import LawFault, run
from maglev_study.comparison.contestants import Contestant
from maglev_study.comparison.experiments import NONE, loops
from maglev_study.comparison.flight import Flight
from maglev_study.references import HOVER, held

NAME = 'made_up_laws.counting'
PERIOD = 1e-3


class Counting:
    """State feedback that knows how often it was asked, and may give up after a while."""

    last = 10**9

    def reset(self) -> None:
        self.asked = 0

    def step(self, measurement: Any, reference: Any) -> Any:
        self.asked += 1
        if self.asked > self.last:
            raise RuntimeError('enough')
        error = measurement.position - reference.position
        rate = measurement.velocity - reference.velocity
        integral = 1e-3 * self.asked  # so that its memory is seen in what it gives
        return reference.acceleration - 1e4 * error - 150.0 * rate - integral


@pytest.fixture(autouse=True)
def _module(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    package, mine = types.ModuleType('made_up_laws'), types.ModuleType(NAME)
    package.__path__ = []
    mine.make = lambda _: Counting()  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, 'made_up_laws', package)
    monkeypatch.setitem(sys.modules, NAME, mine)
    return


def stage() -> SimulatedStage:
    """One that hovers."""
    return SimulatedStage(build(PlantParameters, {'initial.position': tuple(HOVER)}))


def regulator() -> Regulator:
    return Regulator(build(ControllerParameters, {'law': NAME}))


def test_the_loop_is_what_regulator_and_stage_give_in_turn() -> None:
    references = held(HOVER, 0.2, PERIOD)
    found = run(regulator(), stage(), references)
    asked, flown = regulator(), stage()
    direct, quadrature = np.zeros(4), np.zeros(4)
    for k in range(200):
        sample = flown.read()
        np.testing.assert_array_equal(found.state[k], flown.state)
        asked.step(*sample, HOVER, np.zeros(5), np.zeros(5), direct, quadrature)
        np.testing.assert_array_equal(found.direct_current[k], direct)
        flown.write(direct, quadrature)


def test_a_mistake_ends_the_run_with_its_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Counting, 'last', 30)
    with pytest.raises(LawFault, match=r'sample 30: .* raised RuntimeError: enough'):
        run(regulator(), stage(), held(HOVER, 0.1, PERIOD))
    references = held(HOVER, 0.1, PERIOD)
    references.position[3] = np.nan
    with pytest.raises(MeasurementFault, match='sample 3: the reference'):
        run(regulator(), stage(), references)


def test_in_the_comparison_its_memory_goes_back_with_the_flight(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    parameters = build(ControllerParameters, {'law': NAME})
    flight = Flight(Contestant('mine', parameters, PlantParameters()))
    assert flight.follow(held(HOVER, 0.1, PERIOD)) is not None
    saved = flight.save()
    runs = []
    for _ in range(2):
        flight.restore(saved)
        runs.append(flight.follow(held(HOVER, 0.1, PERIOD)))
    assert runs[0] is not None
    assert runs[1] is not None
    np.testing.assert_array_equal(runs[0].state, runs[1].state)
    monkeypatch.setattr(Counting, 'last', 0)
    assert flight.follow(held(HOVER, 0.1, PERIOD)) is None
    assert {row.text for row in loops(Contestant('mine', parameters, PlantParameters()))} == {NONE}
