"""What makes the tracking error small: one thing of the default controller changed at a time.

The paper's 4DOF ellipse on the benchmark plant and on the rough one, without ROS: mean and largest
|e| over the last 60 s for y, x, z [µm] and theta [µrad], on the encoders' own scales, which on the
benchmark plant are the truth.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import AXES, THETA, FloatArray, X, Y, Z
from maglev_model.parameters import ParameterError, from_yaml, read_yaml, replace, values
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, ellipse
from maglev_study.rough_flights import plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
MEASURED, RUN_IN = 60.0, 10.0  # [s]
SHOWN = (Y, X, Z, THETA)
MISMATCH = {
    'offset.K_v1': 1.1,
    'offset.K_h': 0.9,
    'offset.spring_phi': 0.7,
    'offset.spring_theta': 0.7,
}
WINDINGS = {
    name: value
    for name, value in read_yaml(PARAMS / 'rough.yaml', 'plant').items()
    if name.startswith('effects.winding.')
}
FOR_WINDINGS = {'winding.voltage': 28.0, 'observer.bandwidth': 500.0}
NO_FRICTION = {'guide.coulomb': (0.0,) * 5, 'guide.viscous': (0.0,) * 5}
NO_COUNTS = {'encoder.gap_resolution': 0.0, 'encoder.horizontal_resolution': 0.0}

Values = Mapping[str, object]
Change = Values | Callable[[ControllerParameters], Values]
"""Parameters of the controller, or what makes them of those that it has."""


def on_all_axes(**given: object) -> dict[str, object]:
    """Parameters of every axis, by full name."""
    return {f'{axis}.{name}': value for axis in AXES for name, value in given.items()}


def slower(factor: float) -> Change:
    """All three numbers of every axis by a factor; margins are not what this is about."""
    names = [f'{axis}.{name}' for axis in AXES for name in ('bandwidth', 'integration', 'learning')]

    def change(table: ControllerParameters) -> Values:
        given = values(table)
        return {**{name: factor * given[name] for name in names}, 'margins.override': True}

    return change


ROWS: tuple[tuple[str, Change, Values], ...] = (
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
    ('28 V, not known to the law', {'winding.voltage': 0.0}, WINDINGS),
    ('28 V, known', {'winding.voltage': 28.0}, WINDINGS),
    ('28 V, known, observer of 500 rad/s', FOR_WINDINGS, WINDINGS),
)


def errors(table: ControllerParameters, plant: PlantParameters) -> tuple[FloatArray, FloatArray]:
    """Mean and largest |e| (5,) in 1e-6 m and rad. Raises what makes a flight impossible."""
    references = ellipse(RUN_IN + MEASURED, 0.010, plant.sample_time, grow=2.0)
    outcome = run(Regulator(table), SimulatedStage(plant), references)
    last = round(MEASURED / plant.sample_time)
    error = 1e6 * np.abs(outcome.own - references.position)[-last:]
    return error.mean(axis=0), error.max(axis=0)


def cells(table: ControllerParameters, plant: PlantParameters) -> str:
    """Two cells of a row."""
    try:
        found = errors(table, plant)
    except ParameterError:
        return 'refused | '
    except MeasurementFault:
        return 'lost | '
    return ' | '.join(' / '.join(f'{figures[axis]:.1f}' for axis in SHOWN) for figures in found)


def line(name: str, controller: Change, plant: Values, *overlays: str) -> str:
    """A row: on the benchmark plant, then on the rough one."""
    found = []
    for kind in ((), ('rough',)):
        files = [PARAMS / f'{name}.yaml' for name in ('controller', *overlays, *kind)]
        table = from_yaml(ControllerParameters, 'controller', *files)
        table = replace(table, controller(table) if callable(controller) else controller)
        stage = replace(plant_of(PARAMS, *kind), {'initial.position': tuple(HOVER), **plant})
        found.append(cells(table, stage))
    return f'| {name} | {" | ".join(found)} |'


def main() -> int:
    """Print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.parse_args()
    print(
        '| changed | benchmark plant: mean y / x / z / θ | largest | rough plant: mean | largest |'
        '\n|:--|--:|--:|--:|--:|'
    )
    for name, controller, plant in ROWS:
        print(line(name, controller, plant), flush=True)
    print(line("the paper's law", {}, {}, 'paper', 'paper_exact'), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
