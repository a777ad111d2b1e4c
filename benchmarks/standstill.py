"""Standing still on every friction: the largest error of the last 10 s after a move.

For each friction, on the benchmark plant with encoders that count about 0 and about places at
random (``--phases``), twelve places reached in 1 s: the largest |e| of y, x, z [µm] and phi, theta
[µrad], on the encoders' own scales, and the largest by the paper's resolution.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import FloatArray
from maglev_model.parameters import from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, shaped
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
PERIOD, MOVE, HELD, JUDGED = 1e-3, 1.0, 15.0, 10_000  # [s], [s], [s], samples
SPAN = np.array([0.003, 0.02, 0.02, 0.001, 0.006])  # of the places, to each side
PLACES, SUBSTEPS = 12, 10
RESOLUTION = np.array([1e-5, 1e-5, 1e-5, 2e-5, 2e-5])  # the paper's
MOST = 0.8  # of it

BY_SPEED = 'guide.coulomb_velocity'
MODEL, RATIO, BREAKAWAY = (f'effects.friction.{n}' for n in ('model', 'static_ratio', 'breakaway'))
FRICTIONS: Mapping[str, Mapping[str, object]] = {
    'tanh, v0 1 mm/s': {BY_SPEED: (1e-3,) * 5},
    'tanh, v0 0.1 mm/s': {BY_SPEED: (1e-4,) * 5},
    'Coulomb, set-valued': {MODEL: 'coulomb'},
    'Coulomb, Stribeck 1.3': {MODEL: 'coulomb', RATIO: 1.3},
    'LuGre, 5 µm': {MODEL: 'lugre', BREAKAWAY: (5e-6, 5e-6, 5e-6, 12.6e-6, 12.6e-6)},
    'LuGre, 20 µm': {MODEL: 'lugre', BREAKAWAY: (20e-6, 20e-6, 20e-6, 50e-6, 50e-6)},
    'none': {'guide.coulomb': (0.0,) * 5, 'guide.viscous': (0.0,) * 5},
}


def worst_of(plant: PlantParameters, table: ControllerParameters) -> FloatArray:
    """Largest |e| (5,) over the places; infinite where the platen is lost."""
    regulator, rng = Regulator(table), np.random.default_rng(5)
    found = np.zeros(5)
    for _ in range(PLACES):
        goal = HOVER + SPAN * rng.uniform(-1.0, 1.0, 5)
        stage = SimulatedStage(replace(plant, {'initial.position': tuple(HOVER)}))
        regulator.reset()
        try:
            outcome = run(regulator, stage, shaped(HOVER, goal, MOVE, HELD, PERIOD))
        except MeasurementFault:
            return np.full(5, np.inf)
        error = np.abs(outcome.own - goal)[-JUDGED:]
        found = np.maximum(found, error.max(axis=0))
    return found


def main() -> int:
    """Print the table in Markdown; 1 where an axis moves by more than 0.8 of the resolution."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--phases', type=int, default=4, help='of the encoders, the first at 0')
    options = parser.parse_args()
    table = from_yaml(ControllerParameters, 'controller', PARAMS / 'controller.yaml')
    print('| friction | largest y / x / z / phi / theta | by the resolution |\n|:--|--:|--:|')
    beyond = False
    for name, values in FRICTIONS.items():
        plants = [
            replace(
                plant_of(PARAMS, seed=seed),
                {**values, 'effects.sensor.random_phase': seed > 0, 'substeps': SUBSTEPS},
            )
            for seed in range(options.phases)
        ]
        fly = delayed(worst_of)
        worst = np.max(Parallel(n_jobs=-1)(fly(plant, table) for plant in plants), axis=0)
        share = float(np.max(worst / RESOLUTION))
        beyond |= share > MOST and name != 'none'
        print(
            f'| {name} | {" / ".join(f"{1e6 * e:.1f}" for e in worst)} | {share:.2f} |', flush=True
        )
    return int(beyond)


if __name__ == '__main__':
    sys.exit(main())
