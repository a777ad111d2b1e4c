"""Iterative learning of the 4DOF ellipse, pass by pass, on the benchmark plant and the rough one.

Mean |e| of y / x / z [µm] and phi / theta [µrad] on the encoders' own scales over each pass of 4 s
(three turns), with ``params/learning.yaml``; the pass after the last flies what was learned.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from maglev_controller.learning import IterativeLearning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import FloatArray
from maglev_model.parameters import from_yaml, replace
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, ellipse
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
RUN_IN, AFTER = 8.0, 2


def passes(theta: float, seed: int, *overlays: str) -> FloatArray:
    """Mean |e| of each pass (n, 5) in 1e-6 m and rad."""
    files = [PARAMS / f'{name}.yaml' for name in ('controller', *overlays, 'learning')]
    table = from_yaml(ControllerParameters, 'controller', *files)
    plant = replace(plant_of(PARAMS, *overlays, seed=seed), {'initial.position': tuple(HOVER)})
    count, period = table.learning.passes + AFTER, table.sample_time
    references = ellipse(RUN_IN + count * table.learning.period, theta, period, grow=2.0)
    learning, first = IterativeLearning(table), round(RUN_IN / period)
    outcome = run(
        Regulator(table),
        SimulatedStage(plant),
        references,
        learning=learning,
        follows=np.arange(len(references.position)) >= first,
    )
    error = 1e6 * np.abs(outcome.own - references.position)[first:]
    print(learning.describe(), file=sys.stderr)
    return np.asarray(error.reshape(count, -1, 5).mean(axis=1))


def main() -> int:
    """Print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeds', type=int, default=1, help='rough machines that are drawn')
    options = parser.parse_args()
    cases = {
        'benchmark plant, 3DOF': (0.0, 0, ()),
        'benchmark plant': (0.010, 0, ()),
        **{f'rough plant, {k}': (0.010, k, ('rough',)) for k in range(options.seeds)},
    }
    print('| plant | first pass | second | eighth | then |\n|:--|--:|--:|--:|--:|')
    for name, (theta, seed, overlays) in cases.items():
        found = passes(theta, seed, *overlays)
        cells = (' / '.join(f'{value:.1f}' for value in found[k]) for k in (0, 1, 7, -1))
        print(f'| {name} | {" | ".join(cells)} |', flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
