"""Converters, amplifiers and latency."""

from __future__ import annotations

import numpy as np
import pytest
from rough import ONLY_X, ZERO, M, ideal_stage

from maglev_model.motor import force_coefficients

STILL = {'guide__locked': (True,) * 5, 'amplifier__bandwidth': 0.0}


def _flowing(samples: int = 2, **overrides: object) -> np.ndarray:
    stage = ideal_stage(**STILL, **overrides)
    for _ in range(samples):
        stage.read()
        stage.write([1.001, -2.003, 0.5004, 3.1], [0.1, 0.2007, 0.3, -0.4])
    stage.read()
    return np.array(stage.arrays.effects.winding.phase)


def test_a_converter_of_12_bits_gives_whole_counts() -> None:
    plain = _flowing(effects__drive__noise=1e-300)
    counted = _flowing(effects__drive__dac_bits=12)
    count = 20.0 / 4096.0
    assert counted / count == pytest.approx(np.round(plain / count), abs=1e-9)
    assert np.abs(counted - plain).max() <= 0.5 * count + 1e-12
    assert np.abs(counted - plain).max() > 0.2 * count


def test_a_converter_ends_at_its_range() -> None:
    clipped = _flowing(effects__drive__dac_bits=12, effects__drive__dac_range=2.0)
    assert clipped.max() == pytest.approx(2.0 - 4.0 / 4096.0)
    assert clipped.min() == pytest.approx(-2.0, abs=1e-12)


def test_gain_and_offset_of_each_phase() -> None:
    plain = _flowing(effects__drive__noise=1e-300)
    gain, offset = np.linspace(0.9, 1.1, 12), np.linspace(-0.05, 0.05, 12)
    found = _flowing(effects__drive__gain=tuple(gain), effects__drive__offset=tuple(offset))
    assert found == pytest.approx(gain * plain + offset, abs=1e-12)


def test_spreads_are_drawn_by_the_seed_and_noise_by_sample() -> None:
    offsets = np.array(
        [
            ideal_stage(seed=s, effects__drive__offset_spread=0.01).arrays.effects.drive.offset
            for s in range(100)
        ]
    )
    assert offsets.std() == pytest.approx(0.01, rel=0.1)
    stage = ideal_stage(**STILL, effects__drive__noise=0.02)
    noise = []
    for _ in range(400):
        stage.read()
        noise.append(stage.arrays.effects.winding.phase.copy())
    drawn = np.array(noise[1:])
    assert drawn.std(axis=0) == pytest.approx(np.full(12, 0.02), rel=0.2)
    assert np.abs(np.corrcoef(drawn.T) - np.eye(12)).max() < 0.25


@pytest.mark.parametrize('latency', [0.0, 0.3, 1.0, 1.75])
@pytest.mark.parametrize('substeps', [1, 4])
def test_a_command_acts_after_its_latency_also_within_a_sample(
    latency: float, substeps: int
) -> None:
    """A push from sample 0 on has moved the platen by a (t - latency)²/2."""
    stage = ideal_stage(
        guide__locked=ONLY_X,
        amplifier__bandwidth=0.0,
        substeps=substeps,
        effects__drive__latency=latency,
        effects__drive__noise=1e-300,
    )
    stage.read()
    stage.write(ZERO, [0.0, -1.0, 0.0, -1.0])
    for _ in range(6):
        stage.read()
    push = 2.0 * force_coefficients(M, 0.025)[3] / M.M_x
    assert stage.state[3] == pytest.approx(push * (6.0 - latency) * 1e-3, rel=1e-5)
    if substeps == 4 and latency in (0.0, 1.0, 1.75):
        assert stage.state[2] == pytest.approx(0.5 * push * ((6.0 - latency) * 1e-3) ** 2, rel=1e-5)
