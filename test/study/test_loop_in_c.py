"""The loop in C that ours is measured against does the same work."""

from __future__ import annotations

import importlib
import shutil
from pathlib import Path

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import build, read_yaml
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import ellipse

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(shutil.which('cc') is None, reason='needs a C compiler')
def test_the_loop_in_c_flies_the_same_trajectory(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over the ellipse from a moving start, at which currents are limited, without counts."""
    monkeypatch.syspath_prepend(str(ROOT / 'benchmarks'))
    library = importlib.import_module('in_c').LoopInC()
    references = ellipse(2.0, 0.010, 1e-3)
    given = read_yaml(ROOT / 'params' / 'benchmark.yaml', 'plant')
    given |= {
        'initial.position': tuple(references.position[0]),
        'initial.velocity': tuple(references.velocity[0]),
        'encoder.gap_resolution': 0.0,
        'encoder.horizontal_resolution': 0.0,
    }
    parameters = build(PlantParameters, given)
    ours = run(Regulator(ControllerParameters()), SimulatedStage(parameters), references)
    regulator, stage = Regulator(ControllerParameters()), SimulatedStage(parameters)
    state, current = library.run(regulator, stage, references)
    assert ours.saturated.any()
    assert not ours.saturated.all()
    assert np.abs(state - ours.state).max() < 1e-9
    answered = np.hstack((ours.direct_current, ours.quadrature_current))
    assert np.abs(current - answered).max() < 1e-6
    stage.arrays.state[0] = 0.040
    with pytest.raises(RuntimeError, match='sample 0: a limit is met'):
        library.run(regulator, stage, references)
