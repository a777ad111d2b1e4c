"""Currents within the voltage, against the plant's own windings."""

from __future__ import annotations

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import ellipse

PERIOD = 1e-3
PLANT = {'effects.winding.voltage': 28.0, 'substeps': 10}


def test_28_volts_carry_the_ellipse_and_are_not_asked_for_more() -> None:
    """With L(g): errors of 2 µm, and what flows at each sample's end is what was asked for."""
    references = ellipse(9.0, 0.010, PERIOD, grow=2.0)
    table = build(PlantParameters, {'initial.position': tuple(references.position[0]), **PLANT})
    regulator = Regulator(
        build(ControllerParameters, {'winding.voltage': 28.0, 'observer.bandwidth': 500.0})
    )
    outcome = run(regulator, SimulatedStage(table), references)
    error = 1e6 * np.abs(outcome.output - references.position)[-5000:]
    assert np.all(error.mean(axis=0) < [2.0, 2.0, 2.0, 1.0, 8.0])
    steps = np.abs(np.diff(outcome.direct_current, axis=0)).max()
    assert steps < 28.0 * PERIOD / 0.045 * 1.2


def flown_currents(law: dict[str, object]) -> tuple[np.ndarray, np.ndarray]:
    """Currents asked for and those that flow in the windings when the sample is over (n, 8) [A]."""
    references = ellipse(1.5, 0.010, PERIOD, grow=0.5)
    stage = SimulatedStage(
        build(PlantParameters, {'initial.position': tuple(references.position[0]), **PLANT})
    )
    regulator, answer = Regulator(build(ControllerParameters, law)), np.zeros((2, 4))
    asked, flowing = [], []
    for wanted in zip(*references, strict=True):
        reading = stage.read()
        flowing.append(stage.arrays.flowing.copy())  # at the end of the sample before
        regulator.step(*reading, *wanted, *answer)
        asked.append(answer.ravel().copy())
        stage.write(*answer)
    return np.array(asked)[50:-1], np.array(flowing)[51:]


def test_what_is_asked_for_flows_in_the_windings() -> None:
    """Within what the angle turns by in a sample; a law that does not know the rail misses it."""
    missed = {}
    for voltage in (0.0, 28.0):
        asked, flowing = flown_currents({'winding.voltage': voltage})
        missed[voltage] = np.abs(flowing - asked).max(axis=1)
    assert missed[28.0].max() < 0.02
    assert missed[0.0].max() > 0.1
    assert np.mean(missed[0.0] > 0.02) > 0.1
