"""The default law and the paper's on the rough plant: ellipse, slow scans, holds of 60 s.

Mean and largest |e| of y / x / z [µm] and phi / theta [µrad]: of the true position, of that on the
encoders' own scales between the counts, and as they count; what is lost and what hunts. ``--each``
also flies the ellipse and a hold with one effect of ``params/rough.yaml`` at a time.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from maglev_model.axes import FloatArray
from maglev_model.parameters import read_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_study.rough_flights import Errors, Outcome, experiments, fly_rough, laws, plant_of

PARAMS = Path(__file__).resolve().parents[1] / 'params'
PERIOD = 1e-3


def figures(values: FloatArray) -> str:
    """Five figures in micro."""
    return ' / '.join(f'{1e6 * value:.1f}' for value in values)


def cells(errors: Errors) -> str:
    """Mean and peak."""
    return f'{figures(errors.mean)} | {figures(errors.peak)}'


def line(law: str, outcome: Outcome) -> str:
    """One row."""
    name = f'| {law} | {outcome.name} |'
    if outcome.true is None or outcome.own is None or outcome.measured is None:
        return f'{name} lost: {outcome.lost} | | | | | | |'
    note = f'hunts: {figures(outcome.true.movement)}' if outcome.hunting else ''
    note = note if outcome.name.startswith('hold') else ''
    sources = (outcome.true, outcome.own, outcome.measured)
    return ' | '.join([name[:-2], *map(cells, sources), note]) + ' |'


def one_at_a_time() -> dict[str, PlantParameters]:
    """The benchmark plant with each group of effects by itself."""
    given = read_yaml(PARAMS / 'rough.yaml', 'plant')
    groups = sorted({name.split('.')[1] for name in given if name.startswith('effects.')})
    found = {'none': plant_of(PARAMS, substeps=given['substeps'])}
    for group in groups:
        chosen = {k: v for k, v in given.items() if k.startswith(f'effects.{group}.')}
        found[group] = replace(found['none'], chosen)
    return found


def main() -> int:
    """Fly and print, in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seed', type=int, default=0, help='the machine that is drawn')
    parser.add_argument('--hold', type=float, default=60.0, help='length of a hold [s]')
    parser.add_argument('--each', action='store_true', help='one effect at a time, too')
    options = parser.parse_args()
    print(
        '| law | flight | true: mean | largest | own scale: mean | largest | counted: mean '
        '| largest | note |'
    )
    print('|:--|:--|--:|--:|--:|--:|--:|--:|:--|')
    rough = plant_of(PARAMS, 'rough', seed=options.seed)
    for experiment in experiments(PERIOD, hold=options.hold):
        for law, controller in laws(PARAMS).items():
            print(line(law, fly_rough(rough, controller, experiment)), flush=True)
    if options.each:
        chosen = [e for e in experiments(PERIOD, 20.0, 1) if e.name in ('ellipse', 'hold 1')]
        for effect, plant in one_at_a_time().items():
            for experiment in chosen:
                outcome = fly_rough(plant, laws(PARAMS)['default law'], experiment)
                print(line(f'default, {effect}', outcome), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
