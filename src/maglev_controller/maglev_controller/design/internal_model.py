"""The internal model (14), (15): its poles are the frequencies a regulator shall track or reject.

Two realisations of the same poles. ``companion`` is (15) to the letter, and grows ill-conditioned
with every further frequency; ``modal`` is one integrator and one oscillator per frequency, side by
side.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError


@dataclasses.dataclass(frozen=True)
class InternalModel:
    """ξ̇ = Φ ξ + N e, part of w = Γ ξ, equation (14).

    ``frequencies`` (m,) in rad/s, ascending, 0 for the integrator; ``state`` Φ (n, n), ``input`` N
    (n,), ``output`` Γ (n,). A frequency above 0 takes two states, so n = 2 m, less 1 with the
    integrator. ``mode`` (n,) tells for every state which of the frequencies it belongs to (modal
    form).
    """

    frequencies: FloatArray
    state: FloatArray
    input: FloatArray
    output: FloatArray
    mode: NDArray[np.int64]
    form: str

    @property
    def order(self) -> int:
        """Number of states n."""
        return int(self.state.shape[0])

    @property
    def oscillating(self) -> NDArray[np.bool_]:
        """Which of the states (n,) belong to an oscillator (modal form)."""
        return np.asarray(self.frequencies[self.mode] > 0.0)


def polynomial(frequencies: Sequence[float] | FloatArray) -> FloatArray:
    """d(s) = Π (s² + ω²), with the factor s for ω = 0, (n + 1,), highest power first."""
    product = np.ones(1)
    for omega in frequencies:
        factor = np.array([1.0, 0.0]) if omega == 0.0 else np.array([1.0, 0.0, omega**2])
        product = np.polymul(product, factor)
    return product


def internal_model(frequencies: Sequence[float], form: str, axis: str = 'axis') -> InternalModel:
    """The internal model with poles at ±iω for every ω [rad/s] of ``frequencies``.

    ``form`` is ``companion``, equation (15), or ``modal``. Raises :class:`ParameterError`, naming
    ``axis``, for a frequency that is negative, not finite or given twice: a mode held twice cannot
    be told apart in e, so no gain stabilises it.
    """
    ordered = sorted(frequencies)
    for omega in ordered:
        if not np.isfinite(omega) or omega < 0.0:
            raise ParameterError(
                f'{axis}: internal-model frequency {omega:g} rad/s must be finite and at least 0'
            )
    for lower, upper in itertools.pairwise(ordered):
        if upper - lower <= 1e-6 * upper:
            raise ParameterError(
                f'{axis}: internal-model frequency {upper:g} rad/s is given twice; the two copies '
                'cannot be told apart, so no gain stabilises both'
            )
    build = _companion if form == 'companion' else _modal
    return build(np.array(ordered, dtype=np.float64))


def _companion(frequencies: FloatArray) -> InternalModel:
    coefficients = polynomial(frequencies)
    n = coefficients.size - 1
    state = np.eye(n, k=1)
    state[-1:, :] = -coefficients[:0:-1]
    drive, output = np.zeros(n), np.zeros(n)
    drive[-1:], output[:1] = 1.0, 1.0
    mode = np.zeros(n, dtype=np.int64)
    return InternalModel(frequencies, state, drive, output, mode, 'companion')


def _modal(frequencies: FloatArray) -> InternalModel:
    sizes = [1 if omega == 0.0 else 2 for omega in frequencies]
    n = sum(sizes)
    state, drive = np.zeros((n, n)), np.zeros(n)
    row = 0
    for omega, size in zip(frequencies, sizes, strict=True):
        drive[row] = 1.0
        if size == 2:
            state[row, row + 1], state[row + 1, row] = omega, -omega
        row += size
    mode = np.repeat(np.arange(len(sizes)), sizes).astype(np.int64)
    return InternalModel(frequencies, state, drive, drive.copy(), mode, 'modal')
