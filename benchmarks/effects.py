"""What each effect of a real stage costs: time of a sample by that of the plain plant, in one run.

The stage by itself, encoders and dynamics in a compiled loop, moving in x and z. Effects are those
of ``params/rough.yaml``, one group at a time and all together, with as many steps a sample as the
plain plant (2), and all together with their own (10). ``off`` is the plain plant measured again:
how far its ratio is from 1 is what a ratio is worth here. Exits with 1 when all together, with two
steps, cost more than the limit.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

from maglev_model.compiled import compiled
from maglev_model.compiled.records import Block
from maglev_model.parameters import build, read_yaml
from maglev_plant.dynamics import advance
from maglev_plant.encoder import encode
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

ROUGH = Path(__file__).resolve().parents[1] / 'params' / 'rough.yaml'
SAMPLES, ROUNDS = 20_000, 7
LIMIT = 12.0
MOVING = {
    'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0),
    'guide.locked': (True, False, False, True, True),
    'disturbance.amplitude': (0.0, 10.0, 10.0, 0.0, 0.0),
}


@compiled
def carry(block: Block, samples: int) -> None:
    """Encoders and dynamics, sample by sample."""
    for _ in range(samples):
        encode(block)
        advance(block)


def stages() -> dict[str, SimulatedStage]:
    """The plain plant, with each group of effects, with all."""
    given = read_yaml(ROUGH, 'plant')
    effects = {name: value for name, value in given.items() if name.startswith('effects.')}
    groups: dict[str, dict[str, object]] = {'plain': {}, 'off': {}}
    for name, value in effects.items():
        groups.setdefault(name.split('.')[1], {})[name] = value
    groups['all of them'] = dict(effects)
    groups['all, ten steps'] = dict(given)
    return {
        name: SimulatedStage(build(PlantParameters, {**MOVING, **values}))
        for name, values in groups.items()
    }


def main() -> int:
    """Measure in turns, print the best of each by the best of the plain plant."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    made = stages()
    best = dict.fromkeys(made, float('inf'))
    for stage in made.values():
        carry(stage.arrays.block, 10)
    for _ in range(ROUNDS):
        for name, stage in made.items():
            start = time.process_time()
            carry(stage.arrays.block, SAMPLES)
            best[name] = min(best[name], time.process_time() - start)
    for name, seconds in best.items():
        ratio = seconds / best['plain']
        print(f'{name:16s}{1e6 * seconds / SAMPLES:8.2f} us a sample{ratio:8.2f}')
    return int(best['all of them'] > LIMIT * best['plain'])


if __name__ == '__main__':
    sys.exit(main())
