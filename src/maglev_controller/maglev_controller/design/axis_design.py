"""What a control law designs for one axis: a linear compensator, sampled, that runs as it is."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, solve_discrete_are

from maglev_controller.design.derivative import DerivativeFilter
from maglev_controller.design.digits import rounded
from maglev_controller.design.internal_model import InternalModel
from maglev_controller.design.notch import Notch, notch_system
from maglev_controller.design.observer import NO_OBSERVER, Observer
from maglev_controller.design.state_space import StateSpace
from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError

_DIGITS = {'gain': 8, 'drive': 8, 'antiwindup': 8, 'transition': 13}  # oscillators must not decay


@dataclasses.dataclass(frozen=True)
class AxisDesign:
    """w = k (e, ė) + κ ξ and ξ⁺ = Φ_d ξ + N_d e + E_d (what was realised less what was wanted).

    ``gain`` (n + 2,) is k, then κ, which for an internal model is that of (16) with Γ in it;
    ``transition`` Φ_d (n, n), ``drive`` N_d (n,), ``antiwindup`` E_d (n,). Rates come from
    ``observer`` where there is one, else from ``derivative``. ``stiffness`` α [1/s²] of the plant ë
    = α e + w that it is designed for: 0 where the inverse takes all of it away.

    ``limits_errors``: large errors are fed back and learned from only as far as the parameters
    ``limits.error`` and ``internal_model.largest_error`` say. ``fades``: where the reference rests,
    oscillators fade. ``notches`` filter w but for what is fed forward. ``model`` is the internal
    model that ξ is the state of, where it is one.

    All of it is rounded, see :mod:`~maglev_controller.design.digits`.
    """

    gain: FloatArray
    transition: FloatArray
    drive: FloatArray
    antiwindup: FloatArray
    derivative: DerivativeFilter
    observer: Observer = NO_OBSERVER
    stiffness: float = 0.0
    limits_errors: bool = False
    fades: bool = False
    notches: tuple[Notch, ...] = ()
    model: InternalModel | None = None

    def __post_init__(self) -> None:
        for name, digits in _DIGITS.items():
            object.__setattr__(self, name, rounded(getattr(self, name), digits))
        object.__setattr__(self, 'observer', Observer(*rounded(self.observer, 8).tolist()))

    @property
    def order(self) -> int:
        """Number of states n."""
        return int(self.drive.size)


def resting(design: AxisDesign, doubt: float) -> AxisDesign:
    """What is left of a design that fades where the reference has rested for long.

    That is the integrator of the internal model alone, and an observer that believes counts less by
    ``doubt``, 0 to 1.
    """
    assert design.model is not None
    kept = ~design.model.oscillating
    states = np.concatenate(([True, True], kept))
    believed = (1.0 - doubt) * np.array(design.observer)
    return dataclasses.replace(
        design,
        gain=design.gain[states],
        transition=design.transition[np.ix_(kept, kept)],
        drive=design.drive[kept],
        antiwindup=design.antiwindup[kept],
        observer=Observer(*believed.tolist()),
    )


class FeedbackSystem(NamedTuple):
    """x⁺ = A x + B_e e + B_w w, v = C x + D e: the error and what of w acts make the feedback."""

    state: FloatArray
    error_input: FloatArray
    acting_input: FloatArray
    output: FloatArray
    direct: float


def feedback_system(design: AxisDesign, period: float, delay: int) -> FeedbackSystem:
    """The feedback before its notches; ``delay`` is what the observer predicts over.

    State (ξ, f) with the derivative filter; (ξ, predicted position and rate) with the observer, and
    the w still to act with a delay.
    """
    n, gain = design.order, design.gain
    if design.observer == NO_OBSERVER:
        rate, forget = design.derivative
        state = np.zeros((n + 1, n + 1))
        state[:n, :n], state[n, n] = design.transition, 1.0 - forget
        return FeedbackSystem(
            state,
            np.append(design.drive, forget),
            np.zeros(n + 1),
            np.append(gain[2:], -gain[1] * rate),
            float(gain[0] + gain[1] * rate),
        )
    step, push = np.array([[1.0, period], [0.0, 1.0]]), np.array([0.5 * period**2, period])
    correction = np.array(design.observer)
    size = n + 2 + (delay > 0)
    seen, read = np.zeros((2, size)), correction
    seen[:, n : n + 2] = np.eye(2) - np.outer(correction, [1.0, 0.0])
    after, after_read = step @ seen, step @ read  # but for what acts
    used, used_read = seen, read
    if delay:
        after[:, n + 2] = push
        used, used_read = after, after_read
    output, direct = gain[:2] @ used, float(gain[:2] @ used_read)
    output[:n] += gain[2:]
    state, drive, acting = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    state[:n, :n], drive[:n] = design.transition, design.drive
    state[n : n + 2], drive[n : n + 2] = after, after_read
    if delay:
        acting[n + 2] = 1.0
    else:
        acting[n : n + 2] = push
    return FeedbackSystem(state, drive, acting, output, direct)


def controller_system(design: AxisDesign, period: float, delay: int) -> StateSpace:
    """e to w as ``control_step`` computes it, notches last: states of feedback, then of notches."""
    inner = feedback_system(design, period, delay)
    filters = notch_system(design.notches)
    n = inner.error_input.size
    size = n + filters.input.size
    state, drive, output = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    output[:n], output[n:] = filters.direct * inner.output, filters.output
    direct = filters.direct * inner.direct
    state[:n, :n], drive[:n] = inner.state, inner.error_input
    state[n:, :n] = np.outer(filters.input, inner.output)
    state[n:, n:] = filters.state
    drive[n:] = filters.input * inner.direct
    state[:n] += np.outer(inner.acting_input, output)
    drive[:n] += inner.acting_input * direct
    return StateSpace(state, drive, output, direct)


def following_gain(
    transition: FloatArray, output: FloatArray, period: float, speed: float, axis: str = 'axis'
) -> FloatArray:
    """Anti-windup gain E_d (n,) that makes a compensator's state follow what was realised.

    While w is limited, ξ⁺ = Φ_d ξ + N_d e + E_d (sat w − w) has the matrix Φ_d − E_d κ, κ the
    ``output`` (n,): an observer of ξ from the realised w. E_d is the stationary Kalman gain for
    process noise of size ``speed`` [rad/s] through κ's direction; the larger, the faster the state
    lets go. Raises :class:`ParameterError`, naming the axis, when there is none.
    """
    scale = np.linalg.norm(output)
    if scale == 0.0:
        return np.zeros(output.size)
    direction = output / scale
    noise = np.eye(output.size) * (speed * period) ** 2
    try:
        solution = solve_discrete_are(transition.T, direction[:, None], noise, np.eye(1))
    except (LinAlgError, ValueError) as error:
        raise ParameterError(
            f'{axis}: no anti-windup follows at internal_model.antiwindup_speed of {speed:g} rad/s '
            f'with a sample time of {period:g} s ({error})'
        ) from error
    return np.asarray(
        transition @ solution @ direction / (1.0 + direction @ solution @ direction) / scale
    )
