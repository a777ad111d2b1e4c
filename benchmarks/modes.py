"""One flexible mode of one axis, known to 5 %: how fast the axis stays, and the ellipse it flies.

For frequencies and modal gains, both signs: the speed of the axis by that without a mode, the
sensitivity peak wherever the mode is, and on the benchmark plant with the mode 5 % off either way
the larger mean |e| of the 4DOF ellipse's last 6 s [µm, µrad].
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import AXES
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import ellipse

FREQUENCIES = (80.0, 120.0, 160.0, 220.0, 300.0, 400.0)  # [Hz]
GAINS = (-0.3, 0.3)
DAMPING, TOLERANCE = 0.01, 0.05
LAST = 6000  # samples


def mode(axis: str, frequency: float, gain: float) -> dict[str, object]:
    """A group ``modes`` with one mode."""
    return {'axis': (axis,), 'frequency': (frequency,), 'damping': (DAMPING,), 'gain': (gain,)}


def flown(axis: str, frequency: float, gain: float) -> str:
    """A row of the table."""
    known = {f'modes.{name}': value for name, value in mode(axis, frequency, gain).items()}
    regulator = Regulator(build(ControllerParameters, known))
    index = AXES.index(axis)
    plain = Regulator(ControllerParameters())
    speed = np.sqrt(regulator.designs[index].gain[0] / plain.designs[index].gain[0])
    references = ellipse(12.0, 0.010, 1e-3, grow=2.0)
    worst = np.zeros(5)
    for share in (1.0 - TOLERANCE, 1.0 + TOLERANCE):
        true = mode(axis, share * frequency, gain)
        plant = {f'effects.modes.{name}': value for name, value in true.items()}
        plant |= {'substeps': 10, 'initial.position': tuple(references.position[0])}
        regulator.reset()
        try:
            outcome = run(regulator, SimulatedStage(build(PlantParameters, plant)), references)
        except MeasurementFault:
            worst[:] = np.inf
            break
        error = 1e6 * np.abs(outcome.output - references.position)[-LAST:].mean(axis=0)
        worst = np.maximum(worst, error)
    means = ' / '.join(f'{value:.1f}' for value in worst)
    peak = regulator.margins[index].sensitivity
    return f'| {axis} | {frequency:.0f} | {gain:+.1f} | {speed:.2f} | {peak:.2f} | {means} |'


def main() -> int:
    """Print the table in Markdown."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--axes', nargs='+', choices=AXES, default=AXES)
    arguments = parser.parse_args()
    print('| axis | Hz | modal gain | speed | peak of S | mean y / x / z / φ / θ |')
    print('|:--|--:|--:|--:|--:|--:|')
    for axis in arguments.axes:
        for frequency in FREQUENCIES:
            for gain in GAINS:
                print(flown(axis, frequency, gain), flush=True)
    return 0


if __name__ == '__main__':
    sys.exit(main())
