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
