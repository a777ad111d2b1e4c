"""Flexible modes against SciPy's linear simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rough import ONLY_X, ZERO, M, ideal_stage
from scipy import signal

from maglev_model.motor import force_coefficients
from maglev_model.parameters import ParameterError


@pytest.mark.parametrize('modes', [[(120.0, 0.02, -0.3)], [(80.0, 0.01, 0.3), (390.0, 0.2, 1.0)]])
def test_the_encoder_reads_the_rigid_platen_and_its_modes(
    modes: list[tuple[float, float, float]],
) -> None:
    frequency, damping, gain = (tuple(column) for column in zip(*modes, strict=True))
    stage = ideal_stage(
        guide__locked=ONLY_X,
        effects__modes__axis=('x',) * len(modes),
        effects__modes__frequency=frequency,
        effects__modes__damping=damping,
        effects__modes__gain=gain,
    )
    rng = np.random.default_rng(1)
    currents = rng.uniform(-2.0, 2.0, 300)
    read = []
    for i_q in currents:
        read.append(stage.read().x)
        stage.write(ZERO, [0.0, i_q, 0.0, i_q])
    push = -2.0 * force_coefficients(M, 0.025)[3] / M.M_x * currents
    expected = np.zeros(301)
    for f, zeta, kappa in [(0.0, 0.0, 1.0), *modes]:
        w = 2.0 * math.pi * f
        a, b = np.array([[0.0, 1.0], [-w * w, -2.0 * zeta * w]]), np.array([[0.0], [1.0]])
        step = signal.cont2discrete((a, b, np.array([[kappa, 0.0]]), np.zeros((1, 1))), 1e-3)
        expected += signal.dlsim(step, np.append(push, 0.0))[1][:, 0]
    assert read == pytest.approx(expected[:300], abs=1e-11)
    assert np.ptp(read) > 1e-4


def test_a_tilting_mode_shows_in_the_gaps_and_not_in_the_true_state() -> None:
    locked = (True, True, True, True, False)
    mode = {'effects__modes__axis': ('theta',), 'effects__modes__gain': (0.3,)}
    bent = ideal_stage(guide__locked=locked, **mode)
    stiff = ideal_stage(guide__locked=locked)
    for stage in (bent, stiff):
        stage.write([0.0, 1.0, 0.0, -1.0], ZERO)
        for _ in range(5):
            sample = stage.read()
        stage.last = sample
    assert bent.state == pytest.approx(stiff.state, abs=1e-13)
    apart = np.array(bent.last.gap) - np.array(stiff.last.gap)
    assert apart[1] == pytest.approx(-apart[3], rel=1e-9)
    assert apart[1] > 1e-7
    assert apart[[0, 2]] == pytest.approx([0.0, 0.0], abs=1e-15)


def test_lists_of_different_lengths_are_refused() -> None:
    told = r"'effects\.modes\.axis', 'frequency', 'damping' and 'gain'"
    with pytest.raises(ParameterError, match=told):
        ideal_stage(effects__modes__gain=(0.1, 0.2))
