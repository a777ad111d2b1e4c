"""The default law and the paper's on rough plants: ellipse, slow scans, holds, positioning.

With one machine mean and largest |e| of y / x / z [µm] and phi / theta [µrad]: of the true
position, of that on the encoders' own scales between the counts, and as they count; of a hold its
rms about the mean beside. With more of them (``--machines``) median and worst over the machines, on
the encoders' own scales; frictions and centre of mass are drawn too. Both laws are told what
``params/rough.yaml`` says. ``--each`` also flies the ellipse and a hold with one effect of that
file at a time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from maglev_model.axes import AXES, THETA, FloatArray, X, Y, Z
from maglev_model.parameters import read_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_study.rough_flights import (
    Errors,
    Outcome,
    experiments,
    fly_rough,
    laws,
    machines,
    plant_of,
    positioning,
)

PARAMS = Path(__file__).resolve().parents[1] / 'params'
PERIOD = 1e-3


def figures(values: FloatArray) -> str:
    """Five figures in micro."""
    return ' / '.join(f'{1e6 * value:.1f}' for value in values)


def cells(errors: Errors) -> str:
    """Mean and peak."""
    return f'{figures(errors.mean)} | {figures(errors.peak)}'


def line(law: str, outcome: Outcome) -> str:
    """One row of one machine."""
    name = f'| {law} | {outcome.name} |'
    if outcome.true is None or outcome.own is None or outcome.measured is None:
        return f'{name} lost: {outcome.lost} | | | | | | |'
    note = ''
    if outcome.name.startswith('hold'):
        note = f'rms {figures(outcome.true.movement)}{", hunts" if outcome.hunting else ""}'
    sources = (outcome.true, outcome.own, outcome.measured)
    return ' | '.join([name[:-2], *map(cells, sources), note]) + ' |'


def line_of_many(law: str, outcomes: Sequence[Outcome]) -> str:
    """One row of many machines: what flew, by axis the median and the worst of them."""
    own = [outcome.own for outcome in outcomes if outcome.own is not None]
    hunting = sum(outcome.hunting for outcome in outcomes) if 'hold' in outcomes[0].name else 0
    note = f'{len(outcomes) - len(own)} lost{f", {hunting} hunt" if hunting else ""}'
    found = (
        np.array([getattr(errors, name) for errors in own]).reshape(-1, len(AXES))
        for name in ('mean', 'peak', 'rms', 'movement')
    )
    shown = [
        figures(middle(rows, axis=0)) if len(rows) else ''
        for rows in found
        for middle in (np.median, np.max)
    ]
    return f'| {law} | {outcomes[0].name} | {" | ".join(shown)} | {note} |'


def fly_many(count: int, hold: float, places: int, chosen: Sequence[str]) -> None:
    """Print the table of many machines."""
    print(
        '| law | flight | mean: median | worst | largest: median | worst '
        '| rms: median | worst | about the mean: median | worst | note |'
        '\n|:--|:--|--:|--:|--:|--:|--:|--:|--:|--:|:--|'
    )
    plants = list(machines(PARAMS, count))
    workers = Parallel(n_jobs=-1)
    for experiment in experiments(PERIOD, hold=hold, places=places):
        for law, controller in laws(PARAMS, 'rough').items():
            if law in chosen:
                fly = delayed(fly_rough)
                found = workers(fly(plant, controller, experiment) for plant in plants)
                print(line_of_many(law, found), flush=True)


def fly_one(seed: int, hold: float, places: int, chosen: Sequence[str]) -> None:
    """Print the tables of one machine."""
    print(
        '| law | flight | true: mean | largest | own scale: mean | largest | counted: mean '
        '| largest | note |\n|:--|:--|--:|--:|--:|--:|--:|--:|:--|'
    )
    rough = plant_of(PARAMS, 'rough', seed=seed)
    flown = {law: table for law, table in laws(PARAMS, 'rough').items() if law in chosen}
    for experiment in experiments(PERIOD, hold=hold, places=places):
        for law, controller in flown.items():
            print(line(law, fly_rough(rough, controller, experiment)), flush=True)
    print('\n| law | axis | position | R, ISO 230-2 | reversal | bias | 3 s | accuracy |')
    print('|:--|:--|:--|--:|--:|--:|--:|--:|')
    for law, controller in flown.items():
        for axis in (Y, X, Z, THETA):
            for source, found in (positioning(rough, controller, axis) or {}).items():
                shown = ' | '.join(f'{1e6 * value:.1f}' for value in found)
                print(f'| {law} | {AXES[axis]} | {source} | {shown} |', flush=True)


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
    known = tuple(laws(PARAMS))
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seed', type=int, default=0, help='the machine, where it is one')
    parser.add_argument('--machines', type=int, default=1, help='how many, drawn from 0 on')
    parser.add_argument('--laws', nargs='+', choices=known, default=known)
    parser.add_argument('--hold', type=float, default=60.0, help='length of a hold [s]')
    parser.add_argument('--places', type=int, default=3, help='where it is held')
    parser.add_argument('--each', action='store_true', help='one effect at a time, too')
    options = parser.parse_args()
    if options.machines > 1:
        fly_many(options.machines, options.hold, options.places, options.laws)
    else:
        fly_one(options.seed, options.hold, options.places, options.laws)
    if options.each:
        flights = [e for e in experiments(PERIOD, 20.0, 1) if e.name in ('ellipse', 'hold 1')]
        for effect, plant in one_at_a_time().items():
            for experiment in flights:
                outcome = fly_rough(plant, laws(PARAMS)['default law'], experiment)
                print(line(f'default, {effect}', outcome), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
