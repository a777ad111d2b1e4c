"""The six encoders of the simulated stage."""

from __future__ import annotations

import math

import numpy as np
import pytest

from maglev_model.contract.stage import EncoderSample
from maglev_model.parameters import build
from maglev_plant.encoder import gaussian
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

POSITION = (0.0251234, 0.0123456, -0.0234567, 0.0012, -0.0087)


def _first(**overrides: object) -> EncoderSample:
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    stage = SimulatedStage(build(PlantParameters, {'initial.position': POSITION, **named}))
    return stage.read()


def _truth() -> list[float]:
    y, x, z, phi, theta = POSITION
    r = 0.397
    return [
        y - r * math.sin(phi),
        y + r * math.sin(theta),
        y + r * math.sin(phi),
        y - r * math.sin(theta),
        x,
        z,
    ]


def test_without_counts_the_encoders_are_exact() -> None:
    sample = _first(encoder__gap_resolution=0.0, encoder__horizontal_resolution=0.0)
    assert [*sample.gap, sample.x, sample.z] == pytest.approx(_truth(), abs=1e-16)


def test_readings_are_the_nearest_counts() -> None:
    sample = _first()
    read = np.array([*sample.gap, sample.x, sample.z])
    counts = read / 10e-6
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.max(np.abs(read - _truth())) <= 5e-6
    assert np.max(np.abs(read - _truth())) > 1e-6


def test_noise_repeats_with_its_seed_and_only_with_it() -> None:
    noisy = {'encoder__gap_noise': 5e-6, 'encoder__horizontal_noise': 5e-6}
    first, again, other = _first(**noisy), _first(**noisy), _first(**noisy, seed=1)
    assert list(first.gap) == list(again.gap)
    assert (first.x, first.z) == (again.x, again.z)
    assert list(first.gap) != list(other.gap)


def test_noise_is_standard_normal_and_independent() -> None:
    drawn = np.array([[gaussian(3, k, c) for c in range(6)] for k in range(5000)])
    assert drawn.mean(axis=0) == pytest.approx(np.zeros(6), abs=0.06)
    assert drawn.std(axis=0) == pytest.approx(np.ones(6), abs=0.05)
    correlation = np.corrcoef(np.vstack([drawn.T, [*drawn[1:, 0].tolist(), 0.0]]))
    assert np.max(np.abs(correlation - np.eye(7))) < 0.06
    assert np.mean(np.abs(drawn) > 1.96) == pytest.approx(0.05, abs=0.006)


def test_noise_comes_before_the_count() -> None:
    sample = _first(encoder__gap_noise=50e-6)
    counts = sample.gap / 10e-6
    assert counts == pytest.approx(np.round(counts), abs=1e-9)
    assert np.max(np.abs(sample.gap - _truth()[:4])) > 5e-6
