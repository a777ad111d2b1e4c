"""Internal model: poles, the paper's own matrices, and exact discretisation."""

from __future__ import annotations

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.design.internal_model import internal_model
from maglev_controller.design.state_space import discretise
from maglev_model.parameters import ParameterError

OMEGA = 1.5 * np.pi
multiples = st.lists(st.integers(0, 8), min_size=1, max_size=6, unique=True)


def test_companion_form_is_equation_15() -> None:
    """Φ, N, Γ for the poles 0 and ±iω0 are the paper's, entry by entry."""
    model = internal_model([0.0, OMEGA], 'companion')
    np.testing.assert_array_equal(model.state, [[0, 1, 0], [0, 0, 1], [0, -(OMEGA**2), 0]])
    np.testing.assert_array_equal(model.input, [0, 0, 1])
    np.testing.assert_array_equal(model.output, [1, 0, 0])


@pytest.mark.parametrize('form', ['companion', 'modal'])
@settings(max_examples=25)
@given(multiples=multiples)
def test_poles_are_the_frequencies(form: str, multiples: list[int]) -> None:
    """Φ has the eigenvalues ±iω of the list, and 0 once when it is in it."""
    model = internal_model([m * OMEGA for m in multiples], form)
    assert model.order == sum(1 if m == 0 else 2 for m in multiples)
    wanted = sorted(sign * m for m in multiples for sign in ((1,) if m == 0 else (-1, 1)))
    poles = np.linalg.eigvals(model.state) / OMEGA
    np.testing.assert_allclose(np.sort(poles.imag), wanted, atol=1e-6)
    np.testing.assert_allclose(poles.real, 0.0, atol=1e-6)


def test_both_forms_pass_the_same_frequencies() -> None:
    """Both are controllable from e and observable in w, the modal one well conditioned."""
    frequencies = [0.0, OMEGA, 2.0 * OMEGA]
    for form in ('companion', 'modal'):
        model = internal_model(frequencies, form)
        reach = control.ctrb(model.state / OMEGA, model.input[:, None])
        watch = control.obsv(model.state / OMEGA, model.output[None, :])
        assert np.linalg.matrix_rank(reach) == np.linalg.matrix_rank(watch) == 5


@pytest.mark.parametrize('frequencies', [[0.0, 0.0], [OMEGA, OMEGA], [0.0, OMEGA, OMEGA + 1e-9]])
def test_a_frequency_twice_is_refused(frequencies: list[float]) -> None:
    """Two copies of a mode cannot both be stabilised from one input."""
    with pytest.raises(ParameterError, match=r'theta: .* given twice'):
        internal_model(frequencies, 'modal', 'theta')


@pytest.mark.parametrize('omega', [-1.0, float('nan'), float('inf')])
def test_no_frequency_is_refused(omega: float) -> None:
    """Negative and not finite frequencies do not exist."""
    with pytest.raises(ParameterError, match='must be finite and at least 0'):
        internal_model([0.0, omega], 'companion')


@pytest.mark.parametrize('form', ['companion', 'modal'])
def test_discretisation_is_exact(form: str) -> None:
    """As python-control's zero-order hold, and a sampled oscillator neither grows nor decays."""
    model = internal_model([0.0, OMEGA, 2.0 * OMEGA], form)
    state, held = discretise(model.state, model.input[:, None], 1e-3)
    system = control.ss(model.state, model.input[:, None], model.output[None, :], 0.0)
    sampled = control.c2d(system, 1e-3, 'zoh')
    np.testing.assert_allclose(state, sampled.A, rtol=1e-10, atol=1e-13)
    np.testing.assert_allclose(held, sampled.B, rtol=1e-10, atol=1e-16)
    if form == 'modal':
        turn = np.linalg.matrix_power(state, 10**6)
        assert np.linalg.norm(turn[1:, 1:], 2) == pytest.approx(1.0, abs=1e-7)
