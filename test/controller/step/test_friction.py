"""Friction fed forward and its level; standing still with steep friction."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import PHI
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, ellipse, joined, shaped

PERIOD = 1e-3
SPEEDS = np.array([0.005, 0.03, 0.03, 0.0, 0.01]) * 1.5 * np.pi * 2.0 / np.pi  # mean
LEVELS = np.array([0.303, 0.171, 0.149, 1.32, 1.32]) + 0.5 * SPEEDS  # with what is viscous


def flown(regulator: Regulator, plant: dict[str, object], references) -> np.ndarray:  # type: ignore[no-untyped-def]
    """True errors (n, 5) [µm, µrad]."""
    table = build(PlantParameters, {'initial.position': tuple(references.position[0]), **plant})
    outcome = run(regulator, SimulatedStage(table), references)
    return np.asarray(1e6 * (outcome.output - references.position))


def test_the_level_is_learned_and_halves_the_peaks() -> None:
    """On the 4DOF ellipse the plant's own levels, within a tenth; theta peaks at half."""
    references = ellipse(14.0, 0.010, PERIOD, grow=2.0)
    peaks = {}
    for time in (0.0, 2.0):
        regulator = Regulator(build(ControllerParameters, {'friction.adaptation_time': time}))
        error = np.abs(flown(regulator, {}, references)[-6000:])
        peaks[time] = error.max(axis=0)
        learned = regulator.arrays.axes['friction']
        if time > 0.0:
            moving = np.arange(5) != PHI
            np.testing.assert_allclose(learned[moving], LEVELS[moving], rtol=0.1)
            assert learned[PHI] == 0.0
            assert np.all(error.mean(axis=0) < [1.3, 1.5, 1.5, 0.5, 3.5])
            assert np.all(peaks[time] < [8.5, 8.5, 8.5, 1.0, 20.0])
        else:
            assert not learned.any()
    assert peaks[2.0][4] < 0.6 * peaks[0.0][4]


def test_no_level_is_learned_above_its_bound() -> None:
    """And none below 0, on a plant that pushes along."""
    references = ellipse(4.0, 0.0, PERIOD, grow=1.0)
    chosen = {'friction.largest': (0.05,) * 5, 'friction.adaptation_time': 0.2}
    regulator = Regulator(build(ControllerParameters, chosen))
    flown(regulator, {}, references)
    learned = regulator.arrays.axes['friction'][:3]
    assert np.all((learned > 0.02) & (learned <= 0.05))


@pytest.mark.parametrize('v0', [1e-2, 1e-3, 3e-4])
def test_standing_still_is_quiet_with_steeper_friction(v0: float) -> None:
    """Within 0.8 counts on every axis for 10 s after a move, tilts by the count at the radius."""
    goal = np.array([0.028, 0.010, -0.010, 0.0, 0.005])
    references = joined(shaped(HOVER, goal, 0.3, 13.0, PERIOD))
    plant = {'guide.coulomb_velocity': (v0,) * 5, 'substeps': 4 if v0 < 1e-3 else 2}
    if v0 < 1e-3:
        plant['substeps'] = 10
    error = np.abs(flown(Regulator(ControllerParameters()), plant, references)[-10_000:])
    assert np.all(error.max(axis=0) < [8.0, 8.0, 8.0, 10.0, 10.0])


def test_counts_rounded_down_are_told_by_a_parameter() -> None:
    """With ``floor`` y, x and z are half a count more than read."""
    positions = []
    for rounding in ('nearest', 'floor'):
        regulator = Regulator(build(ControllerParameters, {'encoder.rounding': rounding}))
        zero, direct, quadrature = np.zeros(5), np.zeros(4), np.zeros(4)
        regulator.step(np.full(4, 0.025), 0.0, 0.0, HOVER, zero, zero, direct, quadrature)
        positions.append(regulator.position.copy())
    np.testing.assert_allclose(positions[1] - positions[0], [5e-6, 5e-6, 5e-6, 0, 0], atol=1e-12)
