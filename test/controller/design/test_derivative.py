"""The derivative filter against its transfer function."""

from __future__ import annotations

import control
import numpy as np
import pytest

from maglev_controller.design.derivative import derivative_filter

PERIOD = 1e-3


def respond(bandwidth: float, discretisation: str, signal: np.ndarray) -> np.ndarray:
    """The filter's output, started as at enable."""
    gain, forget = derivative_filter(bandwidth, PERIOD, discretisation)
    state, rates = signal[0], []
    for value in signal:
        rates.append(gain * (value - state))
        state += forget * (value - state)
    return np.array(rates)


@pytest.mark.parametrize('bandwidth', [100.0, 1000.0])
def test_tustin_is_python_controls(bandwidth: float) -> None:
    """The frequency response is that of s a / (s + a), sampled by Tustin's rule."""
    gain, forget = derivative_filter(bandwidth, PERIOD, 'tustin')
    own = control.tf([gain, -gain], [1.0, forget - 1.0], PERIOD)
    wanted = control.c2d(control.tf([bandwidth, 0.0], [1.0, bandwidth]), PERIOD, 'tustin')
    omega = np.geomspace(1.0, 3000.0, 30)
    np.testing.assert_allclose(
        own(np.exp(1j * omega * PERIOD)), wanted(np.exp(1j * omega * PERIOD)), rtol=1e-9
    )


@pytest.mark.parametrize('discretisation', ['tustin', 'matched'])
def test_a_ramp_gives_its_slope_and_a_constant_gives_nothing(discretisation: str) -> None:
    """No kick at the first sample, no bias after the transient."""
    ramp = 0.025 + 0.3 * PERIOD * np.arange(200)
    rates = respond(1000.0, discretisation, ramp)
    assert rates[0] == 0.0
    assert rates[-1] == pytest.approx(0.3, rel=1e-9)
    assert not np.any(respond(1000.0, discretisation, np.full(50, 0.025)))


def test_matched_has_the_filters_pole() -> None:
    """The sampled pole is exp(-a T)."""
    _, forget = derivative_filter(700.0, PERIOD, 'matched')
    assert 1.0 - forget == pytest.approx(np.exp(-0.7))
