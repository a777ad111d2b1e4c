"""The observer's gain, and what it sees."""

from __future__ import annotations

import control
import numpy as np
import pytest

from maglev_controller.design.observer import observer

PERIOD = 1e-3
STEP = np.array([[1.0, PERIOD], [0.0, 1.0]])
PUSH = np.array([0.5 * PERIOD**2, PERIOD])


@pytest.mark.parametrize('bandwidth', [100.0, 800.0, 3000.0])
def test_the_gain_is_python_controls(bandwidth: float) -> None:
    """By ``control.dlqe``, the acceleration's noise integrated over a sample."""
    density = bandwidth**4
    noise = density * np.array([[PERIOD**3 / 3, PERIOD**2 / 2], [PERIOD**2 / 2, PERIOD]])
    ahead, _, _ = control.dlqe(STEP, np.eye(2), np.eye(1, 2), noise, np.array([[1.0 / PERIOD]]))
    found = np.array(observer(bandwidth, PERIOD))
    np.testing.assert_allclose(STEP @ found, ahead[:, 0], rtol=1e-6)


@pytest.mark.parametrize('bandwidth', [1.0, 850.0, 1e5])
@pytest.mark.parametrize('period', [*np.geomspace(1e-5, 1e-2, 12), 1.38e-4])
def test_each_bandwidth_and_sample_time_has_its_gain(bandwidth: float, period: float) -> None:
    """What the stationary Riccati equation says of them, in samples and readings' errors."""
    position, speed = np.array(observer(bandwidth, period)) * [1.0, period]
    ratio = (bandwidth * period) ** 4
    assert speed**2 == pytest.approx(ratio * (1.0 - position), rel=1e-7, abs=1e-12 * ratio)
    assert position**2 == pytest.approx(speed * (2.0 - position) - speed**2 / 6.0, rel=1e-9)


def test_slow_ones_have_butterworths_poles() -> None:
    """Two poles at the bandwidth, 45 degrees off the axis."""
    gain = np.array(observer(50.0, PERIOD))
    values = np.linalg.eigvals(STEP @ (np.eye(2) - np.outer(gain, [1.0, 0.0])))
    poles = np.log(values.astype(complex)) / PERIOD
    np.testing.assert_allclose(np.abs(poles), 50.0, rtol=0.02)
    np.testing.assert_allclose(np.abs(np.angle(poles, deg=True)), 135.0, atol=2.0)


def test_it_finds_a_rate_that_its_input_explains_without_lag() -> None:
    """A known acceleration, from a wrong start: the estimate converges to the truth exactly."""
    gain = np.array(observer(300.0, PERIOD))
    truth, estimate = np.array([0.01, -0.2]), np.zeros(2)
    for k in range(400):
        estimate = estimate + gain * (truth[0] - estimate[0])
        acceleration = 5.0 * np.sin(0.1 * k)
        estimate = STEP @ estimate + PUSH * acceleration
        truth = STEP @ truth + PUSH * acceleration
    np.testing.assert_allclose(estimate, truth, rtol=0.0, atol=1e-9)
