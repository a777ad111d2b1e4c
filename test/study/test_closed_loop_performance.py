"""The default regulator's figures, row by row as ``benchmarks/performance.py`` prints them.

Here is a part of the rows that takes seconds; the benchmark flies them all.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from maglev_controller.regulator import Regulator
from maglev_study.references import HOVER, ellipse, held


def _load() -> ModuleType:
    path = Path(__file__).resolve().parents[2] / 'benchmarks' / 'performance.py'
    spec = importlib.util.spec_from_file_location('performance', path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules['performance'] = module
    spec.loader.exec_module(module)
    return module


performance = _load()
NOMINAL = performance.Condition('benchmark', {})
LATE = performance.Condition('a sample late', {}, True, 1.5)
MISMATCHES = {condition.name: condition for condition in performance.mismatches()}


@pytest.fixture(scope='module', name='regulator')
def _regulator() -> Regulator:
    found: Regulator = performance.regulator()
    return found


@pytest.mark.parametrize('condition', [NOMINAL, LATE], ids=['benchmark', 'late'])
@pytest.mark.parametrize('theta', [0.0, 0.010])
def test_ellipses(regulator: Regulator, condition: object, theta: float) -> None:
    """At most 4 µm in y, x, z, 5 µrad in φ, 12 µrad in θ."""
    row = performance.mean_error(
        regulator, condition, ellipse(16.0, theta, performance.PERIOD), 8.0
    )
    assert row.share <= 1.0, row


@pytest.mark.parametrize('raw', [False, True], ids=['shaped', 'raw'])
@pytest.mark.parametrize('name', performance.STEPS)
def test_steps(regulator: Regulator, name: str, raw: bool) -> None:
    """Overshoot ≤ 1 %, t_s ≤ 0.25 s, t_enc ≤ 0.6 s and stays for 10 s."""
    row = performance.step(regulator, NOMINAL, name, raw=raw)
    assert row.share <= 1.0, row


@pytest.mark.parametrize('name', performance.STEPS)
def test_steps_with_currents_a_sample_late(regulator: Regulator, name: str) -> None:
    """Within 1.5 times."""
    row = performance.step(regulator, LATE, name, hold=4.0)
    assert row.share <= 1.0, row


@pytest.mark.parametrize('condition', [NOMINAL, LATE], ids=['benchmark', 'late'])
def test_standstill_has_no_limit_cycle(regulator: Regulator, condition: object) -> None:
    """Within the encoders' resolution for 10 s wherever the set-point lies between counts."""
    row = performance.standstill(regulator, condition, 4)
    assert row.share <= 1.0, row


@pytest.mark.parametrize('name', ['K_v2 -10 %', 'spring_theta -30 %', 'mixed 3', 'mixed 16'])
def test_model_and_plant_apart(regulator: Regulator, name: str) -> None:
    """Every figure within twice the limits."""
    condition = MISMATCHES[name]
    row = performance.mean_error(
        regulator, condition, ellipse(12.0, 0.010, performance.PERIOD), 6.0
    )
    assert row.share <= 1.0, row
    for step in ('y 30 to 20 mm', 'x -30 to 30 mm', 'theta -10 to 10 mrad', 'all five at once'):
        row = performance.step(regulator, condition, step, hold=4.0)
        assert row.share <= 1.0, row


def test_what_no_current_can_hold_is_told_apart() -> None:
    """Two of the mixed draws have an attraction above the weight whatever i_d does."""
    heavy = [
        name
        for name, condition in MISMATCHES.items()
        if np.subtract(*performance.least_attraction(condition, 0.020)) > 0.0
    ]
    assert heavy == ['mixed 7', 'mixed 14']
    least, weight = performance.least_attraction(NOMINAL, 0.020)
    assert least == pytest.approx(0.0, abs=1e-6)
    assert weight == pytest.approx(67.7, abs=0.1)


@pytest.mark.parametrize(
    ('name', 'plant'), [p for p in performance.disturbances() if p[0].startswith('both')]
)
def test_disturbances(regulator: Regulator, name: str, plant: dict[str, object]) -> None:
    """10 N and 5 N sinusoidal: mean error ≤ 5 µm while they act, their onset included."""
    condition = performance.Condition(name, plant)
    still = held(HOVER, 10.0, performance.PERIOD)
    row = performance.disturbed(regulator, condition, still, name)
    assert row.share <= 1.0, row
