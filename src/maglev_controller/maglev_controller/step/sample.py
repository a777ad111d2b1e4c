"""One sample of the control law, compiled: (14), (16), (17) and an inverse.

:class:`~maglev_controller.regulator.Regulator` fills the arrays and explains the law.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from maglev_controller.step.arrays import (
    EXACT,
    SIMPLIFIED,
    ControlArrays,
    Currents,
    Reading,
    Record,
    Reference,
)
from maglev_controller.step.estimation import observe, predict, surprises
from maglev_controller.step.friction import friction_ahead, learn_friction
from maglev_controller.step.notch_filter import notched
from maglev_controller.step.rest import error_to_learn, note_motion, shares
from maglev_controller.step.voltage import keep_within_voltage
from maglev_model.axes import FloatArray
from maglev_model.compiled import borrowing
from maglev_model.equilibrium import equilibrium_inverse
from maglev_model.inverse import (
    CURRENT,
    Answer,
    CurrentLimits,
    clip,
    exact_inverse_with,
    simplified_inverse,
)
from maglev_model.machine import Machine
from maglev_model.machine_array import machine_from_array
from maglev_model.platen import outputs_from_gaps
from maglev_model.quintic import quintic_to_zero, time_to_zero

JUMP: Final = 2e-4
"""A change of the reference within one sample that its velocity does not explain [m, rad] and that
counts as a jump, where it is faster than UNTOLD as well."""

UNTOLD: Final = 0.2
"""A reference without velocities can still move so fast [m/s, rad/s]."""

LARGEST_REFERENCE: Final = 1e6
"""Sum of all the reference's magnitudes beyond which it is refused, like one that is not finite."""

# What a step returns: what limited the currents, as bits of the module ``inverse``, or a fault.
OK: Final = 0
FIRST_FAULT: Final = 4
NOT_FINITE: Final = 4
WARPED: Final = 5
OUT_OF_RANGE: Final = 6
BAD_REFERENCE: Final = 7


@borrowing
def _check(
    settings: Record, gap: FloatArray, output: FloatArray, warp: float, reference: Reference
) -> int:
    """Whether gaps, outputs and reference can be used: a fault code, or 0."""
    size = 0.0
    for index in range(5):
        size += (
            abs(reference.position[index])
            + abs(reference.velocity[index])
            + abs(reference.acceleration[index])
        )
    if not math.isfinite(output[0] + output[1] + output[2] + output[3] + output[4]):
        return NOT_FINITE
    if not abs(warp) <= settings.warp:
        return WARPED
    for index in range(5):
        if not settings.lower[index] <= output[index] <= settings.upper[index]:
            return OUT_OF_RANGE
    for motor in range(4):
        if not gap[motor] > 0.0:  # where (1)-(4) mean nothing
            return OUT_OF_RANGE
    if not size < LARGEST_REFERENCE:
        return BAD_REFERENCE
    return OK


@borrowing
def _follow_jump(
    settings: Record, axis: Record, index: int, jump: float
) -> tuple[float, float, float]:
    """What to add to the reference (position, velocity, acceleration) so that it has no jump.

    A jump starts a transition that makes it good in ``jump_time`` or, where it is too far for that,
    within the axis' acceleration; one that comes during another starts from where that one is.
    """
    axis.transition_elapsed += settings.period
    position, velocity, acceleration = quintic_to_zero(
        axis.transition_position,
        axis.transition_velocity,
        axis.transition_acceleration,
        axis.transition_duration,
        axis.transition_elapsed,
    )
    if settings.jump_time > 0.0 and abs(jump) > max(JUMP, UNTOLD * settings.period):
        position -= jump
        axis.transition_position = position
        axis.transition_velocity = velocity
        axis.transition_acceleration = acceleration
        axis.transition_elapsed = 0.0
        most = settings.jump_acceleration[index]
        axis.transition_duration = time_to_zero(
            position, velocity, acceleration, most, settings.jump_time
        )
    return position, velocity, acceleration


@borrowing
def _model_parts(control: ControlArrays, sample: Record) -> None:
    """What the internal models of all axes add to w: κ ξ."""
    for index in range(5):
        part = 0.0
        for row in range(control.xi.shape[1]):
            part += control.models[index, row].output * control.xi[index, row]
        sample.internal_model[index] = part


@borrowing
def _virtual_input(
    settings: Record,
    sample: Record,
    axis: Record,
    index: int,
    position: float,
    velocity: float,
    acceleration: float,
) -> None:
    """w of (16) on one axis with its reference; moves the estimator of the rate on."""
    measured = sample.position[index]
    fresh = axis.fresh
    if fresh:
        axis.fresh, axis.filtered_position = False, measured
        axis.estimated_position, axis.estimated_velocity = measured, 0.0
        axis.pending_acceleration, axis.surprise = 0.0, 0.0
        axis.reference_position = position
        jump = position - measured
    else:
        mean = 0.5 * (velocity + axis.reference_velocity)
        jump = position - axis.reference_position - settings.period * mean
    to_position, to_velocity, to_acceleration = _follow_jump(settings, axis, index, jump)
    smooth_velocity = velocity + to_velocity
    forget = settings.filter_forget[index]
    if not fresh:
        middle = 0.5 * (smooth_velocity + axis.smooth_velocity)
        axis.filtered_velocity += forget * (middle - axis.filtered_velocity)
    note_motion(settings, axis, position, smooth_velocity)
    axis.reference_position, axis.reference_velocity = position, velocity
    axis.reference_acceleration = acceleration
    axis.smooth_position, axis.smooth_velocity = position + to_position, smooth_velocity
    axis.wanted_acceleration = to_acceleration + acceleration
    error = measured - position - to_position
    to_learn = error_to_learn(settings, axis, index, error)
    sample.learned_error[index] = clip(to_learn, settings.learned_error[index])
    if settings.observed[index]:
        seen, seen_velocity = observe(settings, axis, index)
        error, error_rate = seen - position - to_position, seen_velocity - smooth_velocity
        if settings.late:  # what is seen is the next sample
            period, bend = settings.period, axis.wanted_acceleration
            error -= period * (smooth_velocity + 0.5 * period * bend)
            error_rate -= period * bend
    else:
        change = measured - axis.filtered_position
        axis.filtered_position += forget * change
        error_rate = settings.filter_gain[index] * change - axis.filtered_velocity
    error = clip(error, settings.error_limit[index])
    axis.error = error
    axis.bump *= settings.fade
    feedback = settings.error_gain[index] * error + settings.rate_gain[index] * error_rate
    filtered = notched(settings, axis, index, feedback + sample.internal_model[index])
    w = filtered + axis.bump
    sample.error[index] = measured - position
    sample.error_rate[index] = error_rate
    if axis.goes_on > 0.0:
        axis.goes_on -= settings.period
        return
    ahead = to_acceleration + settings.feed_forward * acceleration
    sample.virtual_input[index] = w + ahead + friction_ahead(settings, axis, index)
    if settings.learns:
        sample.virtual_input[index] += axis.learned


@borrowing
def _currents(
    settings: Record, machine: Machine, sample: Record, direct: FloatArray, quadrature: FloatArray
) -> int:
    """The inverse of the settings, from w; what limited the currents."""
    limits = CurrentLimits(
        settings.current, settings.levitation_first, settings.least_attraction, 0.5, settings.tilt
    )
    controlled, wanted = settings.controlled, sample.virtual_input
    answer = Answer(direct, quadrature, sample.realised, sample.excess)
    if settings.inverse == EXACT:
        position = sample.position
        return exact_inverse_with(
            sample.work, machine, limits, controlled, position, wanted, answer
        )
    if settings.inverse == SIMPLIFIED:
        return simplified_inverse(machine, limits, controlled, sample.position, wanted, answer)
    return equilibrium_inverse(machine, limits, controlled, settings.equilibrium, wanted, answer)


@borrowing
def _lost(settings: Record, sample: Record, index: int) -> float:
    """What was realised less what was wanted: of w, or of the currents u_x and u_z as in (17)."""
    if not settings.paper_antiwindup:
        return float(sample.realised[index] - sample.virtual_input[index])
    return float(sample.excess[index - 1]) if index == 1 or index == 2 else 0.0


@borrowing
def _advance_models(control: ControlArrays) -> None:
    """ξ⁺ = Φ_d ξ + N_d e + E_d (what was realised less what was wanted), (14), (17)."""
    models, transition, xi = control.models, control.transition, control.xi
    settings, axes = control.records[0].settings, control.records[0].axes
    sample = control.records[0].sample
    states = xi.shape[1]
    for index in range(5):
        if settings.controlled[index] == 0.0:
            continue
        error, lost = sample.learned_error[index], _lost(settings, sample, index)
        learned, kept = shares(settings, axes[index])
        for row in range(states):
            oscillates = models[index, row].oscillates
            told = learned * error if oscillates else error
            value = models[index, row].drive * told + models[index, row].antiwindup * lost
            for column in range(models[index, row].first, models[index, row].end):
                value += transition[index, row, column] * xi[index, column]
            models[index, row].following = kept * value if oscillates else value
        for row in range(states):
            xi[index, row] = models[index, row].following


@borrowing
def _measure(
    settings: Record, machine: Machine, sample: Record, reading: Reading, reference: Reference
) -> int:
    """The outputs of a reading, and whether they and the reference can be used: a code."""
    output = sample.output
    warp = outputs_from_gaps(machine, reading.gap, reading.x, reading.z, output)
    if settings.floored:
        output[0] += settings.half_gap
        output[1] += settings.half_horizontal
        output[2] += settings.half_horizontal
    return _check(settings, reading.gap, output, warp, reference)


@borrowing
def _virtual_inputs(settings: Record, sample: Record, axes: Record, reference: Reference) -> None:
    """w of all axes; internal models and what surprises the observers are known."""
    for index in range(5):
        sample.position[index] = sample.output[index]
        _virtual_input(
            settings,
            sample,
            axes[index],
            index,
            reference.position[index],
            reference.velocity[index],
            reference.acceleration[index],
        )


@borrowing
def currents_of_w(
    settings: Record, machine: Machine, sample: Record, axes: Record, currents: Currents
) -> int:
    """Currents for the sample's w, and what they realise of it; what limited them.

    Of an axis without control that is nothing: guides hold it, or it is left to its spring.
    """
    direct, quadrature = currents.direct, currents.quadrature
    limited_by = _currents(settings, machine, sample, direct, quadrature)
    if limited_by == 0:
        for index in range(5):
            sample.realised[index] = sample.virtual_input[index]
    if keep_within_voltage(settings, machine, sample, axes, direct, quadrature):
        limited_by |= CURRENT
    for index in range(5):
        if settings.controlled[index] == 0.0:
            sample.realised[index] = 0.0
    return limited_by


@borrowing
def decide(control: ControlArrays, machine: Machine, reading: Reading, reference: Reference) -> int:
    """w of all axes for a reading and a reference. A fault code, or 0."""
    settings, sample = control.records[0].settings, control.records[0].sample
    axes = control.records[0].axes
    code = _measure(settings, machine, sample, reading, reference)
    if code == OK:
        _model_parts(control, sample)
        surprises(settings, machine, axes, reading)
        _virtual_inputs(settings, sample, axes, reference)
    return code


@borrowing
def conclude(control: ControlArrays) -> None:
    """Take what is realised at the sample into observers, friction and internal models."""
    settings, sample = control.records[0].settings, control.records[0].sample
    axes = control.records[0].axes
    for index in range(5):
        if settings.observed[index]:
            predict(settings, axes[index], sample.realised[index])
        learn_friction(settings, axes[index], index, sample.realised[index])
    _advance_models(control)


@borrowing
def control_step(
    control: ControlArrays, reading: Reading, reference: Reference, currents: Currents
) -> int:
    """One sample; see ``Regulator.step``. Returns a code; on a fault only the currents change."""
    records = control.records[0]
    settings, sample, axes = records.settings, records.sample, records.axes
    machine = machine_from_array(settings.machine)
    code = decide(control, machine, reading, reference)
    if code != OK:
        for motor in range(4):
            currents.direct[motor] = 0.0
            currents.quadrature[motor] = 0.0
        return code
    limited_by = currents_of_w(settings, machine, sample, axes, currents)
    conclude(control)
    return limited_by


@borrowing
def answer_sample(
    records: NDArray[np.void],
    models: NDArray[np.void],
    transition: FloatArray,
    xi: FloatArray,
    gap: FloatArray,
    x: float,
    z: float,
    position: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    direct: FloatArray,
    quadrature: FloatArray,
) -> int:
    """:func:`control_step` for calls from Python, which hand over arrays faster than tuples."""
    return control_step(
        ControlArrays(records, models, transition, xi),
        Reading(gap, x, z),
        Reference(position, velocity, acceleration),
        Currents(direct, quadrature),
    )
