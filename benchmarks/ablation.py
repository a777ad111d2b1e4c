"""What makes the tracking error small: one thing of the default controller changed at a time.

The paper's 4DOF ellipse on the benchmark plant, without ROS: mean and largest |e| of the true
position over the last 60 s, for y, x, z [µm] and theta [µrad].
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES, THETA, X, Y, Z
from maglev_model.parameters import build, from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, ellipse

PARAMS = Path(__file__).resolve().parents[1] / 'params'
MEASURED, RUN_IN = 60.0, 10.0  # [s]
SHOWN = (Y, X, Z, THETA)
MISMATCH = {
    'offset.K_v1': 1.1,
    'offset.K_h': 0.9,
    'offset.spring_phi': 0.7,
    'offset.spring_theta': 0.7,
}
NO_FRICTION = {'guide.coulomb': (0.0,) * 5, 'guide.viscous': (0.0,) * 5}
NO_COUNTS = {'encoder.gap_resolution': 0.0, 'encoder.horizontal_resolution': 0.0}

Values = Mapping[str, object]


def on_all_axes(**values: object) -> dict[str, object]:
    """Parameters of every axis, by full name."""
    return {f'{axis}.{name}': value for axis in AXES for name, value in values.items()}


def slower(factor: float) -> dict[str, object]:
    """All three numbers of every axis by a factor; margins are not what this is about."""
    numbers = {'bandwidth': 200.0, 'integration': 90.0, 'learning': 10.0}
    scaled = {name: factor * value for name, value in numbers.items()}
    return {**on_all_axes(**scaled), 'margins.override': True}


ROWS: tuple[tuple[str, Values, Values], ...] = (
    ('default', {}, {}),
    ('bandwidth, integration, learning: a half', slower(0.5), {}),
    ('a quarter', slower(0.25), {}),
    ('an eighth', slower(0.125), {}),
    ('internal model: integrator alone', on_all_axes(multiples=(0.0,)), {}),
    ('internal model: integrator and fundamental', on_all_axes(multiples=(0.0, 1.0)), {}),
    ('without friction fed forward', {'friction.adaptation_time': 0.0}, {}),
    ('oscillators hold at rest', {'internal_model.rest': 'hold'}, {}),
    ('without feed-forward', {'feed_forward': False}, {}),
    ('derivative filter in place of the observer', {'rate_estimate': 'derivative'}, {}),
    ('plant without friction', {}, NO_FRICTION),
    ('encoders without counts', {}, NO_COUNTS),
    ('plant off by 10 and 30 %', {}, MISMATCH),
    ('plant off, integrator alone', on_all_axes(multiples=(0.0,)), MISMATCH),
)


def errors(controller: ControllerParameters, plant: Values) -> tuple[np.ndarray, np.ndarray]:
    """Mean and largest |e| (5,) in 1e-6 m and rad."""
    table = from_yaml(PlantParameters, 'plant', PARAMS / 'machine.yaml', PARAMS / 'benchmark.yaml')
    table = replace(table, {'initial.position': tuple(HOVER), **plant})
    references = ellipse(RUN_IN + MEASURED, 0.010, table.sample_time, grow=2.0)
    outcome = run(Regulator(controller), SimulatedStage(table), references)
    last = round(MEASURED / table.sample_time)
    error = 1e6 * np.abs(outcome.output - references.position)[-last:]
    return error.mean(axis=0), error.max(axis=0)


def line(name: str, controller: ControllerParameters, plant: Values) -> str:
    """One row of the table."""
    mean, peak = errors(controller, plant)
    cells = [' / '.join(f'{figures[axis]:.1f}' for axis in SHOWN) for figures in (mean, peak)]
    return f'| {name} | {cells[0]} | {cells[1]} |'


def main() -> int:
    """Print the table in Markdown."""
    print('| changed | mean y / x / z / θ | largest y / x / z / θ |\n|:--|--:|--:|')
    for name, controller, plant in ROWS:
        print(line(name, build(ControllerParameters, controller), plant), flush=True)
    files = [PARAMS / name for name in ('controller.yaml', 'paper.yaml', 'paper_exact.yaml')]
    print(line("the paper's law", from_yaml(ControllerParameters, 'controller', *files), {}))
    return 0


if __name__ == '__main__':
    sys.exit(main())
