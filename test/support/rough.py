"""A stage of equations alone, with single effects, for the tests of effects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad

from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import force_coefficients
from maglev_model.parameters import build, read_yaml
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

PARAMS = Path(__file__).resolve().parents[2] / 'params'
IDEAL = read_yaml(PARAMS / 'ideal.yaml', 'plant')
HOVER = (0.025, 0.0, 0.0, 0.0, 0.0)
M = machine_constants(MachineParameters())
ZERO = np.zeros(4)
ONLY_X = (True, False, True, True, True)


def ideal_stage(**overrides: object) -> SimulatedStage:
    """The ideal plant at 25 mm; dots of names as ``__``."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return SimulatedStage(build(PlantParameters, {**IDEAL, 'initial.position': HOVER, **named}))


def states(stage: SimulatedStage, samples: int) -> NDArray[np.float64]:
    """States of the next samples, shape (samples, 10)."""
    found = np.empty((samples, 10))
    for k in range(samples):
        stage.read()
        found[k] = stage.arrays.state
    return found


def magnetic_energy(gap: float, strength: float) -> float:
    """Potential of a motor's attraction without current, from 20 mm."""
    work, _ = quad(lambda g: force_coefficients(M, g)[0], 0.020, gap, epsabs=1e-13, epsrel=1e-12)
    return strength**2 * float(work)
