"""A stage without guides (``params/contactless.yaml``): the 4DOF ellipse, and what limits it.

Mean and largest |e| of the true position over the last 20 s for y, x, z [nm] and phi, theta [nrad],
one thing changed at a time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES
from maglev_model.parameters import from_yaml, replace
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, ellipse
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
FILES = (PARAMS / 'controller.yaml', PARAMS / 'contactless.yaml')
RUN_IN, MEASURED = 10.0, 20.0  # [s]
Values = Mapping[str, object]
NO_NOISE = {'encoder.gap_noise': 0.0, 'encoder.horizontal_noise': 0.0}
NO_COUNTS = {'encoder.gap_resolution': 0.0, 'encoder.horizontal_resolution': 0.0}
NO_STEPS = {'effects.drive.dac_bits': 0}
OFF = {'offset.K_v1': 1.1, 'offset.K_h': 0.9, 'offset.spring_phi': 0.7, 'offset.spring_theta': 0.7}


def speeds(factor: float) -> dict[str, object]:
    """All speeds of the law, the observer's among them, by a factor."""
    given = from_yaml(ControllerParameters, 'controller', *FILES)
    scaled = {
        f'{axis}.{name}': factor * getattr(loop, name)
        for axis, loop in zip(AXES, given.axes, strict=True)
        for name in ('bandwidth', 'integration', 'learning')
    }
    return {**scaled, 'observer.bandwidth': factor * given.observer.bandwidth}


ROWS: tuple[tuple[str, Values, Values], ...] = (
    ('as it is', {}, {}),
    ('law twice as fast', speeds(2.0), {}),
    ('law half as fast', speeds(0.5), {}),
    ('sensors without noise', {}, NO_NOISE),
    ('sensors without counts', {}, NO_COUNTS),
    ('converters without steps', {}, NO_STEPS),
    ('none of the three', {}, {**NO_NOISE, **NO_COUNTS, **NO_STEPS}),
    ('plant off by 10 and 30 %', {}, OFF),
)


def line(name: str, controller: Values, plant: Values) -> str:
    """One row of the table."""
    table = replace(from_yaml(ControllerParameters, 'controller', *FILES), controller)
    stage = plant_of(PARAMS, 'contactless')
    stage = replace(stage, {'initial.position': tuple(HOVER), **plant})
    references = ellipse(RUN_IN + MEASURED, 0.010, stage.sample_time, grow=2.0)
    outcome = run(Regulator(table), SimulatedStage(stage), references)
    last = round(MEASURED / stage.sample_time)
    error = 1e9 * np.abs(outcome.output - references.position)[-last:]
    figures = (error.mean(axis=0), error.max(axis=0))
    cells = [' / '.join(f'{value:.1f}' for value in row) for row in figures]
    return f'| {name} | {cells[0]} | {cells[1]} |'


def main() -> int:
    """Print the table in Markdown."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    print('| changed | mean y / x / z / φ / θ | largest |\n|:--|--:|--:|')
    for row in ROWS:
        print(line(*row), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
