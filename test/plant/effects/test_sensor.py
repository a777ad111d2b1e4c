"""Encoders that are not ideal."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rough import ideal_stage

COUNTS = {'encoder__gap_resolution': 10e-6, 'encoder__horizontal_resolution': 10e-6}


def _reading(x: float, z: float = 0.0, y: float = 0.025, **overrides: object) -> np.ndarray:
    stage = ideal_stage(initial__position=(y, x, z, 0.0, 0.0), **overrides)
    sample = stage.read()
    return np.array([*sample.gap, sample.x, sample.z])


def test_floored_counts_are_half_a_count_low_on_the_mean() -> None:
    places = np.random.default_rng(0).uniform(-1e-3, 1e-3, 400)
    floor = {**COUNTS, 'effects__sensor__rounding': 'floor'}
    error = np.array([_reading(x, **floor)[4] - x for x in places])
    assert error.max() <= 1e-12
    assert error.min() > -10e-6
    assert error.mean() == pytest.approx(-5e-6, abs=0.5e-6)


@pytest.mark.parametrize('phase', [-0.4, 0.25])
def test_a_phase_moves_the_edges_and_the_own_scale_knows(phase: float) -> None:
    shifted = {**COUNTS, 'effects__sensor__phase': (0.0,) * 4 + (phase, 0.0)}
    edge = (0.5 - phase) * 10e-6
    assert _reading(edge - 1e-9, **shifted)[4] == 0.0
    assert _reading(edge + 1e-9, **shifted)[4] == pytest.approx(10e-6)
    stage = ideal_stage(initial__position=(0.025, 3e-6, 0.0, 0.0, 0.0), **shifted)
    stage.read()
    assert stage.arrays.effects.sensor.own[4] == pytest.approx(3e-6 + phase * 10e-6, abs=1e-15)


def test_random_phases_are_uniform_and_belong_to_the_seed() -> None:
    phases = np.array(
        [
            ideal_stage(seed=s, effects__sensor__random_phase=True).arrays.effects.sensor.phase
            for s in range(150)
        ]
    )
    assert np.abs(phases).max() <= 0.5
    assert phases.std() == pytest.approx(1.0 / math.sqrt(12.0), rel=0.05)
    again = ideal_stage(seed=3, effects__sensor__random_phase=True).arrays.effects.sensor.phase
    assert list(again) == list(phases[3])


def test_errors_of_cycle_scale_and_squareness() -> None:
    x, z, y = 1.2345e-3, 2.5e-3, 0.02517
    found = _reading(
        x,
        z,
        y,
        effects__sensor__quadrature_error=1.1e-6,
        effects__sensor__scale=(1e-4, 0.0, 0.0, 0.0, 2e-4, 0.0),
        effects__sensor__squareness=(3e-4, 2e-4, -1e-4),
    )
    lengths = np.array([y + 2e-4 * x - 1e-4 * z] * 4 + [x + 3e-4 * z, z])
    lengths *= 1.0 + np.array([1e-4, 0.0, 0.0, 0.0, 2e-4, 0.0])
    lengths += 1.1e-6 * np.sin(2.0 * math.pi * lengths / 40e-6)
    assert found == pytest.approx(lengths, abs=1e-15)


def test_interpolation_errs_twice_a_cycle() -> None:
    places = np.linspace(0.0, 80e-6, 801)[:-1]
    error = [_reading(x, effects__sensor__interpolation_error=0.4e-6)[4] - x for x in places]
    size = np.abs(np.fft.rfft(error)) / 400.0
    assert int(np.argmax(size)) == 4  # in two cycles
    assert size[4] == pytest.approx(0.4e-6, rel=1e-6)
    assert np.delete(size, 4).max() < 1e-9


def test_a_late_sample_reads_what_the_speed_makes_of_it() -> None:
    stage = ideal_stage(
        initial__velocity=(0.0, 0.1, 0.0, 0.0, 0.0),
        guide__locked=(True, False, True, True, True),
        effects__sensor__sampling_jitter=5e-6,
        initial__position=(0.025, -0.04, 0.0, 0.0, 0.0),
    )
    error = []
    for _ in range(600):
        read = stage.read().x
        error.append(read - stage.state[2])
        assert stage.arrays.effects.sensor.own[4] == stage.state[2]
    assert np.std(error) == pytest.approx(0.1 * 5e-6, rel=0.12)
    assert abs(np.mean(error)) < 0.1e-6


def test_noise_comes_before_the_count() -> None:
    noisy = {**COUNTS, 'encoder__gap_noise': 50e-6, 'effects__sensor__rounding': 'floor'}
    gaps = _reading(0.0, **noisy)[:4]
    assert gaps / 10e-6 == pytest.approx(np.round(gaps / 10e-6), abs=1e-9)
    assert np.abs(gaps - 0.025).max() > 10e-6
