"""One sample of the control law on flat arrays, compiled: (14), (16), (17) and an inverse.

:class:`~maglev_controller.regulator.Regulator` fills the arrays and explains the law.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_model.compiled import compiled
from maglev_model.equilibrium import equilibrium_inverse
from maglev_model.inverse import CurrentLimits, exact_inverse, simplified_inverse
from maglev_model.machine import Machine, machine_from_array
from maglev_model.platen import outputs_from_gaps
from maglev_model.quintic import quintic_to_zero, transition_time

FloatArray = NDArray[np.float64]

JUMP: Final = 2e-4
"""A change of the reference within one sample that its velocity does not explain [m, rad] and that
counts as a jump; a reference without velocities can still move at 0.2 m/s."""

LARGEST_REFERENCE: Final = 1e6
"""Sum of all the reference's magnitudes beyond which it is refused, like one that is not finite."""

# Rows of an axis' law: total gain on (e, ė, ξ), N_d, E_d, then Φ_d.
GAIN: Final = 0
DRIVE: Final = 1
ANTIWINDUP: Final = 2
TRANSITION: Final = 3

# Elements of the settings.
FILTER_GAIN: Final = 0  # [1/s]
FILTER_FORGET: Final = 1
FEED_FORWARD: Final = 2
INVERSE: Final = 3  # one of INVERSES, by its number
PAPER_ANTIWINDUP: Final = 4
CURRENT: Final = 5  # [A]
LEVITATION_FIRST: Final = 6
LEAST_ATTRACTION: Final = 7
WARP: Final = 8  # [m]
PERIOD: Final = 9  # [s]
JUMP_TIME: Final = 10  # [s]
CONTROLLED: Final = 11  # five
RANGE: Final = 16  # lower and upper bound of each axis
JUMP_ACCELERATION: Final = 26  # five
EQUILIBRIUM: Final = 31  # air gap [m]
OBSERVER: Final = 32  # 1: rates come from the observer, 0: from the derivative filter
OBSERVER_POSITION: Final = 33
OBSERVER_VELOCITY: Final = 34  # [1/s]
AHEAD: Final = 35  # 1: the observer predicts one sample, as the currents come that late
FADE: Final = 36  # share of a bump that is left a sample later
LARGEST_ERROR: Final = 37  # that an internal model learns from; five
ERROR_LIMIT: Final = 42  # of the error that is fed back; five
SETTINGS: Final = 47

INVERSES: Final = ('simplified', 'exact', 'equilibrium')
SIMPLIFIED: Final = 0
EXACT: Final = 1

# Columns of an axis' state.
FRESH: Final = 0  # 1 before the first sample
FILTER: Final = 1  # f of the derivative filter
LAGGED: Final = 2  # velocity of the reference, through the same filter
LAST_POSITION: Final = 3  # of the reference
LAST_VELOCITY: Final = 4
LAST_SPEED: Final = 5  # of the reference with jumps made good
DURATION: Final = 6  # of the transition that makes a jump good
ELAPSED: Final = 7
OFFSET: Final = 8  # position, velocity, acceleration at its start
ESTIMATE: Final = 11  # position and velocity, predicted for this sample
PENDING: Final = 13  # acceleration commanded that has yet to act, where the currents come late
LAST_ERROR: Final = 14  # as w used it
LAST_ACCELERATION: Final = 15  # of the reference
BUMP: Final = 16  # share of w that fades, so that w does not jump when gains change
MODEL: Final = 17  # ξ

# Rows of the telemetry, and of the scratch space.
POSITION: Final = 0
ERROR: Final = 1
ERROR_RATE: Final = 2
VIRTUAL_INPUT: Final = 3
INTERNAL_MODEL: Final = 4
OUTPUT: Final = 0
REALISED: Final = 1
USED_ERROR: Final = 2
EXCESS: Final = 3
NEXT: Final = 4

# What a step returns; above SATURATED it is a fault.
OK: Final = 0
SATURATED: Final = 1
NOT_FINITE: Final = 2
WARPED: Final = 3
OUT_OF_RANGE: Final = 4
BAD_REFERENCE: Final = 5


class ControlArrays(NamedTuple):
    """What :func:`control_step` works on; n is the order of the largest internal model."""

    constants: FloatArray  # the machine, as machine_from_array takes it
    law: FloatArray  # (5, 3 + n, 2 + n)
    settings: FloatArray  # (SETTINGS,)
    state: FloatArray  # (5, MODEL + n)
    telemetry: FloatArray  # (5, 5)
    scratch: FloatArray  # (5, max(5, n))


@compiled
def _check(settings: FloatArray, output: FloatArray, warp: float, reference_size: float) -> int:
    """Whether the outputs can be used: a fault code, or 0."""
    if not math.isfinite(output[0] + output[1] + output[2] + output[3] + output[4]):
        return NOT_FINITE
    if not abs(warp) <= settings[WARP]:
        return WARPED
    for axis in range(5):
        low, high = settings[RANGE + 2 * axis], settings[RANGE + 2 * axis + 1]
        if not low <= output[axis] <= high:
            return OUT_OF_RANGE
    if not reference_size < LARGEST_REFERENCE:
        return BAD_REFERENCE
    return OK


@compiled
def _follow_jump(
    settings: FloatArray, axis: int, own: FloatArray, jump: float
) -> tuple[float, float, float]:
    """What to add to the reference (position, velocity, acceleration) so that it has no jump.

    A jump starts a transition that makes it good in ``JUMP_TIME`` or, where it is too far for that,
    within the axis' acceleration; one that comes during another starts from where that one is.
    """
    own[ELAPSED] += settings[PERIOD]
    offset, rate, bend = quintic_to_zero(
        own[OFFSET], own[OFFSET + 1], own[OFFSET + 2], own[DURATION], own[ELAPSED]
    )
    if settings[JUMP_TIME] > 0.0 and abs(jump) > JUMP:
        offset -= jump
        own[OFFSET], own[OFFSET + 1], own[OFFSET + 2] = offset, rate, bend
        own[ELAPSED] = 0.0
        own[DURATION] = transition_time(
            offset, settings[JUMP_ACCELERATION + axis], settings[JUMP_TIME]
        )
    return offset, rate, bend


@compiled
def _observe(settings: FloatArray, own: FloatArray, measured: float) -> tuple[float, float]:
    """Position and velocity when w acts: the prediction, corrected with what is measured."""
    surprise = measured - own[ESTIMATE]
    own[ESTIMATE] += settings[OBSERVER_POSITION] * surprise
    own[ESTIMATE + 1] += settings[OBSERVER_VELOCITY] * surprise
    position, velocity = own[ESTIMATE], own[ESTIMATE + 1]
    if settings[AHEAD] != 0.0:
        period, push = settings[PERIOD], own[PENDING]
        position += period * (velocity + 0.5 * period * push)
        velocity += period * push
    return position, velocity


@compiled
def _predict(settings: FloatArray, own: FloatArray, realised: float) -> None:
    """Carry the estimate over to the next sample, its input known."""
    acting = realised
    if settings[AHEAD] != 0.0:
        acting, own[PENDING] = own[PENDING], realised
    period = settings[PERIOD]
    own[ESTIMATE] += period * (own[ESTIMATE + 1] + 0.5 * period * acting)
    own[ESTIMATE + 1] += period * acting


@compiled
def _virtual_inputs(
    law: FloatArray,
    settings: FloatArray,
    state: FloatArray,
    telemetry: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    used_error: FloatArray,
) -> None:
    """w of (16) on every axis; fills the telemetry and moves the derivative filters on."""
    gain, forget = settings[FILTER_GAIN], settings[FILTER_FORGET]
    states = state.shape[1] - MODEL
    for axis in range(5):
        own = state[axis]
        measured = telemetry[POSITION, axis]
        fresh = own[FRESH] != 0.0
        if fresh:
            own[FRESH], own[FILTER] = 0.0, measured
            jump = position[axis] - measured
        else:
            mean = 0.5 * (velocity[axis] + own[LAST_VELOCITY])
            jump = position[axis] - own[LAST_POSITION] - settings[PERIOD] * mean
        offset, rate, bend = _follow_jump(settings, axis, own, jump)
        speed = velocity[axis] + rate
        if not fresh:
            own[LAGGED] += forget * (0.5 * (speed + own[LAST_SPEED]) - own[LAGGED])
        own[LAST_POSITION], own[LAST_VELOCITY], own[LAST_SPEED] = (
            position[axis],
            velocity[axis],
            speed,
        )
        error = measured - position[axis] - offset
        limit = settings[LARGEST_ERROR + axis]
        used_error[axis] = min(max(error, -limit), limit)
        if settings[OBSERVER] != 0.0:
            if fresh:
                own[ESTIMATE], own[ESTIMATE + 1], own[PENDING] = measured, 0.0, 0.0
            seen, rate_seen = _observe(settings, own, measured)
            error, error_rate = seen - position[axis] - offset, rate_seen - speed
        else:
            change = measured - own[FILTER]
            own[FILTER] += forget * change
            error_rate = gain * change - own[LAGGED]
        share = 0.0
        for index in range(states):
            share += law[axis, GAIN, 2 + index] * own[MODEL + index]
        error = min(max(error, -settings[ERROR_LIMIT + axis]), settings[ERROR_LIMIT + axis])
        own[LAST_ERROR], own[LAST_ACCELERATION] = error, acceleration[axis]
        own[BUMP] *= settings[FADE]
        w = law[axis, GAIN, 0] * error + law[axis, GAIN, 1] * error_rate + share + own[BUMP]
        telemetry[ERROR, axis] = measured - position[axis]
        telemetry[ERROR_RATE, axis] = error_rate
        telemetry[INTERNAL_MODEL, axis] = share
        telemetry[VIRTUAL_INPUT, axis] = w + bend + settings[FEED_FORWARD] * acceleration[axis]


@compiled
def _advance_models(
    law: FloatArray,
    settings: FloatArray,
    state: FloatArray,
    telemetry: FloatArray,
    realised: FloatArray,
    excess: FloatArray,
    used_error: FloatArray,
    new: FloatArray,
) -> None:
    """ξ⁺ = Φ_d ξ + N_d e + E_d (what was realised less what was wanted), (14), (17)."""
    states = state.shape[1] - MODEL
    paper = settings[PAPER_ANTIWINDUP] != 0.0
    for axis in range(5):
        if settings[OBSERVER] != 0.0:
            _predict(settings, state[axis], realised[axis])
        if settings[CONTROLLED + axis] == 0.0:
            continue
        error = used_error[axis]
        if paper:
            lost = excess[axis - 1] if axis == 1 or axis == 2 else 0.0
        else:
            lost = realised[axis] - telemetry[VIRTUAL_INPUT, axis]
        for row in range(states):
            value = law[axis, DRIVE, row] * error + law[axis, ANTIWINDUP, row] * lost
            for column in range(states):
                value += law[axis, TRANSITION + row, column] * state[axis, MODEL + column]
            new[row] = value
        for row in range(states):
            state[axis, MODEL + row] = new[row]


@compiled
def _currents(
    machine: Machine,
    settings: FloatArray,
    output: FloatArray,
    wanted: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
    realised: FloatArray,
    excess: FloatArray,
) -> bool:
    """The inverse of the settings; see the module ``inverse`` for the arguments."""
    limits = CurrentLimits(
        settings[CURRENT], settings[LEVITATION_FIRST], settings[LEAST_ATTRACTION]
    )
    controlled = settings[CONTROLLED : CONTROLLED + 5]
    if settings[INVERSE] == EXACT:
        return exact_inverse(
            machine, limits, controlled, output, wanted, direct, quadrature, realised, excess
        )
    if settings[INVERSE] == SIMPLIFIED:
        return simplified_inverse(
            machine, limits, controlled, output, wanted, direct, quadrature, realised, excess
        )
    gap = settings[EQUILIBRIUM]
    return equilibrium_inverse(
        machine, limits, controlled, gap, wanted, direct, quadrature, realised, excess
    )


@compiled
def control_step(
    constants: FloatArray,
    law: FloatArray,
    settings: FloatArray,
    state: FloatArray,
    telemetry: FloatArray,
    scratch: FloatArray,
    gap: FloatArray,
    x: float,
    z: float,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
) -> int:
    """One sample; see ``Regulator.step``. Returns a code; on a fault only the currents change."""
    machine = machine_from_array(constants)
    output, realised, used_error = (
        scratch[OUTPUT, :5],
        scratch[REALISED, :5],
        scratch[USED_ERROR, :5],
    )
    excess, new = scratch[EXCESS, :2], scratch[NEXT]
    warp = outputs_from_gaps(machine, gap, x, z, output)
    size = 0.0
    for axis in range(5):
        size += abs(position[axis]) + abs(velocity[axis]) + abs(acceleration[axis])
    code = _check(settings, output, warp, size)
    if code != OK:
        for motor in range(4):
            direct[motor] = 0.0
            quadrature[motor] = 0.0
        return code
    for axis in range(5):
        telemetry[POSITION, axis] = output[axis]
    _virtual_inputs(law, settings, state, telemetry, position, velocity, acceleration, used_error)
    saturated = _currents(
        machine, settings, output, telemetry[VIRTUAL_INPUT], direct, quadrature, realised, excess
    )
    if not saturated:
        for axis in range(5):
            realised[axis] = telemetry[VIRTUAL_INPUT, axis]
    _advance_models(law, settings, state, telemetry, realised, excess, used_error, new)
    return SATURATED if saturated else OK
