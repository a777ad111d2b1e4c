"""Gains of one axis: the double integrator (13) with its internal model (14) made stable by (16).

Everything here runs once, at configuration. What cannot be stabilised is refused with the reason;
what the sampled loop as a whole does is computed in :mod:`maglev_controller.design.margins`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.linalg import LinAlgError, solve_continuous_are, solve_discrete_are

from maglev_controller.design.internal_model import InternalModel, polynomial
from maglev_controller.design.state_space import ComplexArray, discretise
from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError


@dataclasses.dataclass(frozen=True)
class Weights:
    """LQR weights, all on diagonals: of e, of ė, of each mode of the internal model, and of w.

    ``model`` has one value for all modes; or, in modal form, two, of the integrator and of the
    oscillators, or one per frequency; or, in companion form, one per state.
    """

    error: float
    rate: float
    model: tuple[float, ...]
    effort: float


def bandwidth_weights(bandwidth: float, integration: float, learning: float) -> Weights:
    """The weights that three speeds stand for [rad/s]: W⁴, 2 W², W⁴ i² and W⁴ m², effort 1.

    Without an internal model they put two poles at −W. An integral of e weighs as
    much as e itself after 1 / i, what an oscillator has gathered after 1 / m.
    """
    fourth = bandwidth**4
    return Weights(
        error=fourth,
        rate=2.0 * bandwidth**2,
        model=(fourth * integration**2, fourth * learning**2),
        effort=1.0,
    )


def augmented(model: InternalModel) -> tuple[FloatArray, FloatArray]:
    """The axis with its internal model: state (e, ė, ξ), input the K part of w in (16).

    Returns A (n + 2, n + 2) and B (n + 2,); Γ ξ of (16) is part of A.
    """
    size = model.order + 2
    state, drive = np.zeros((size, size)), np.zeros(size)
    state[0, 1] = 1.0
    state[1, 2:] = model.output
    state[2:, 0] = model.input
    state[2:, 2:] = model.state
    drive[1] = 1.0
    return state, drive


def augmented_discrete(model: InternalModel, period: float) -> tuple[FloatArray, FloatArray]:
    """The same at sample time ``period`` [s], as it runs: w held, and ξ driven by the sampled e,
    held.

    Input the K part of w. Returns A (n + 2, n + 2), B (n + 2,).
    """
    size = model.order + 2
    state, drive = np.eye(size), np.zeros(size)
    drive[:2] = period**2 / 2.0, period
    state[0, 1] = period
    state[2:, 2:], held = discretise(model.state, model.input[:, None], period)
    state[2:, 0] = held[:, 0]
    state[:2, 2:] = np.outer(drive[:2], model.output)
    return state, drive


def place(model: InternalModel, poles: ComplexArray, axis: str = 'axis') -> FloatArray:
    """The gain K (n + 2,) of (16) that puts the closed-loop poles where ``poles`` (n + 2,) [rad/s]
    are.

    With w = κ₁ e + κ₂ ė + κ ξ the characteristic polynomial is (s² − κ₂ s − κ₁) d(s) − n(s), where
    n / d = κ (sI − Φ)⁻¹ N. At a root of d it is −n alone, which gives each mode's gain by itself;
    the two highest powers give κ₂ and κ₁. No ill-conditioned matrix is inverted on the way.

    Raises :class:`ParameterError` for a wrong number of poles, a pole that is not in the open left
    half plane, or a complex one without its conjugate.
    """
    _check_poles(poles, model.order + 2, axis)
    total = np.empty(model.order + 2)
    total[1] = np.sum(poles).real
    pair_products = (np.sum(poles) ** 2 - np.sum(poles**2)).real / 2.0
    total[0] = np.sum(model.frequencies**2) - pair_products
    if model.form == 'companion':
        wanted = np.real(np.poly(poles))
        quadratic = np.array([1.0, -total[1], -total[0]])
        numerator: FloatArray = np.polysub(
            np.polymul(quadratic, polynomial(model.frequencies)), wanted
        )
        total[2:] = numerator[::-1][: model.order]
    else:
        total[2:] = _modal_gains(model, poles)
    total[2:] -= model.output
    return total


def _modal_gains(model: InternalModel, poles: ComplexArray) -> FloatArray:
    gains: list[float] = []
    for index, omega in enumerate(model.frequencies):
        others = np.delete(model.frequencies, index)
        rest = np.prod([others[others > 0.0] ** 2 - omega**2]) if others.size else 1.0
        if np.any(others == 0.0):
            rest = rest * 1j * omega
        value = -np.prod(1j * omega - poles) / rest
        gains += [value.real] if omega == 0.0 else [value.imag / omega, -value.real / omega]
    return np.array(gains)


def _check_poles(poles: ComplexArray, expected: int, axis: str) -> None:
    if poles.size != expected:
        raise ParameterError(
            f'{axis}: {poles.size} closed-loop poles given, this internal model takes {expected}'
        )
    if not np.all(np.isfinite(poles)) or np.any(poles.real >= 0.0):
        raise ParameterError(
            f'{axis}: closed-loop poles need real parts below 0, {_text(poles)} are not stable'
        )
    upper = np.sort_complex(poles[poles.imag > 0.0])
    lower = np.sort_complex(poles[poles.imag < 0.0].conj())
    if upper.size != lower.size or not np.allclose(upper, lower, rtol=1e-9, atol=0.0):
        raise ParameterError(
            f'{axis}: complex closed-loop poles must come in conjugate pairs, {_text(poles)} do not'
        )


def lqr(model: InternalModel, weights: Weights, axis: str = 'axis') -> FloatArray:
    """K (n + 2,) of (16) that minimises ∫ (Σ q x² + r w²) dt, axis continuous, w without Γ ξ."""
    state, drive = augmented(model)
    cost, effort = _cost(model, weights, axis)
    try:
        solution = solve_continuous_are(state, drive[:, None], np.diag(cost), effort)
    except (LinAlgError, ValueError) as error:
        raise _no_gain(axis, error) from error
    return np.asarray(-(drive @ solution) / effort[0, 0])


def dlqr(model: InternalModel, weights: Weights, period: float, axis: str = 'axis') -> FloatArray:
    """K (n + 2,) of (16) that minimises T Σₖ (Σ q x² + r w²) on the sampled axis, w without Γ ξ.

    Raises :class:`ParameterError` when the weights admit no stabilising gain.
    """
    state, drive = augmented_discrete(model, period)
    cost, effort = _cost(model, weights, axis)
    try:
        solution = solve_discrete_are(state, drive[:, None], np.diag(cost), effort)
    except (LinAlgError, ValueError) as error:
        raise _no_gain(axis, error) from error
    row = drive @ solution
    return np.asarray(-(row @ state) / (effort[0, 0] + row @ drive))


def split_phase(model: InternalModel, gain: FloatArray) -> FloatArray:
    """K (n + 2,) with every oscillator turned half-way to where the steepest friction wants it.

    Where the platen moves slowly friction is as good as viscous, with a large slope: it delays the
    answer of the axis at an oscillator's ω from the angle of 1 / (k_p − ω² + i ω k_d), which the
    LQR gains count on, towards −90°. An oscillator is damped by its loop as long as it is less than
    90° off, so with gains for the one it is left undamped at the other, and platen and oscillator
    hunt. Half-way between no friction and infinitely steep friction it is at most 45° off for any.
    """
    turned: FloatArray = gain.copy()
    for index, omega in enumerate(model.frequencies):
        if omega == 0.0:
            continue
        moving = -gain[0] - omega**2 - 1j * omega * gain[1]
        turn = 0.5 * np.angle(1j / moving)
        rows = np.nonzero(model.mode == index)[0]
        first, second = gain[2 + rows] + model.output[rows]
        turned[2 + rows] = (
            np.cos(turn) * first - np.sin(turn) * second,
            np.cos(turn) * second + np.sin(turn) * first,
        )
        turned[2 + rows] -= model.output[rows]
    return turned


def _cost(model: InternalModel, weights: Weights, axis: str) -> tuple[FloatArray, FloatArray]:
    on_states = _model_weights(model, np.array(weights.model, dtype=np.float64), axis)
    cost: FloatArray = np.concatenate(([weights.error, weights.rate], on_states))
    if np.any(cost < 0.0) or not weights.effort > 0.0:
        raise ParameterError(f'{axis}: LQR weights must be at least 0, and the one on w above 0')
    if np.any(on_states == 0.0):
        raise ParameterError(
            f'{axis}: an internal-model state without weight stays undamped; '
            "every element of 'weight_model' must be above 0"
        )
    return cost, np.array([[weights.effort]])


def _model_weights(model: InternalModel, given: FloatArray, axis: str) -> FloatArray:
    """A weight for each internal-model state, from as many as are given."""
    modal = model.form == 'modal'
    if given.size == 1:
        return np.full(model.order, float(given[0]))
    if modal and given.size == 2:
        given = np.where(model.frequencies == 0.0, given[0], given[1])
    expected = model.frequencies.size if modal else model.order
    if given.size != expected:
        raise ParameterError(
            f"{axis}: 'weight_model' has {given.size} elements, this internal model takes 1"
            f'{", 2" if modal else ""} or {expected}'
        )
    return given[model.mode] if modal else given


def _no_gain(axis: str, error: Exception) -> ParameterError:
    return ParameterError(f'{axis}: these LQR weights admit no stabilising gain ({error})')


def poles_from(
    real: Sequence[float], imaginary: Sequence[float], axis: str = 'axis'
) -> ComplexArray:
    """Poles from their real and imaginary parts, as two lists of the same length hold them."""
    if len(real) != len(imaginary):
        raise ParameterError(
            f'{axis}: {len(real)} real and {len(imaginary)} imaginary parts of poles are given, '
            'each pole needs both'
        )
    return np.asarray(np.array(real) + 1j * np.array(imaginary), dtype=np.complex128)


def _text(poles: ComplexArray) -> str:
    return '[' + ', '.join(f'{pole:.4g}' for pole in poles) + ']'
