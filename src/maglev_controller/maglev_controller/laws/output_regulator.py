"""The internal-model regulator (14)-(17): the paper's own, and with more frequencies the default.

Feedback linearisation by either inverse; state feedback of e, ė and an internal model of what is to
be tracked or rejected. ``params/paper.yaml`` makes it the paper's to the letter.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from maglev_controller.checks import check_inverse
from maglev_controller.design.axis_design import AxisDesign, following_gain
from maglev_controller.design.derivative import derivative_filter
from maglev_controller.design.gains import (
    Weights,
    bandwidth_weights,
    dlqr,
    lqr,
    place,
    poles_from,
    split_phase,
)
from maglev_controller.design.internal_model import InternalModel, internal_model
from maglev_controller.design.modes import Case, stabilised
from maglev_controller.design.observer import NO_OBSERVER, observer
from maglev_controller.design.state_space import discretise
from maglev_controller.parameters import AxisParameters, ControllerParameters
from maglev_model.axes import FloatArray
from maglev_model.parameters import ParameterError


def check(parameters: ControllerParameters) -> None:
    """Needs double integrators."""
    check_inverse(parameters, linear=False)


def design(parameters: ControllerParameters, axis: str) -> AxisDesign:
    """Gains from poles or weights, for the internal model of the axis, and notches for its modes.

    Modes make the axis slower where its gains come from speeds. Raises :class:`ParameterError`,
    naming the axis and the reason, for a choice that has no stabilising gain.
    """
    chosen: AxisParameters = getattr(parameters, axis)

    def build(factor: float) -> AxisDesign:
        slower = {
            name: factor * getattr(chosen, name)
            for name in ('bandwidth', 'integration', 'learning')
        }
        return _design(parameters, dataclasses.replace(chosen, **slower), axis)

    given = parameters.modes
    case = Case(
        given.of(axis),
        given.tolerance,
        parameters.sample_time,
        parameters.input_delay,
        given.sensitivity,
    )
    return stabilised(build, case)


def _design(parameters: ControllerParameters, chosen: AxisParameters, axis: str) -> AxisDesign:
    shared, period = parameters.internal_model, parameters.sample_time
    model = _model(parameters, axis)
    gain = _gain(chosen, model, period, axis)
    fades = shared.rest == 'fade' and model.form == 'modal'
    if fades and chosen.design != 'poles':
        gain = split_phase(model, gain)
    gain[2:] += model.output
    inputs = np.stack([model.input, _paper_antiwindup(chosen, model, axis)], axis=1)
    transition, driven = discretise(model.state, inputs, period)
    antiwindup = np.zeros(model.order)
    if shared.antiwindup == 'paper':
        antiwindup = driven[:, 1]
    elif shared.antiwindup == 'observer':
        antiwindup = following_gain(transition, gain[2:], period, shared.antiwindup_speed, axis)
    watched = parameters.rate_estimate == 'observer'
    return AxisDesign(
        gain=gain,
        transition=transition,
        drive=driven[:, 0],
        antiwindup=antiwindup,
        derivative=derivative_filter(
            parameters.derivative.bandwidth, period, parameters.derivative.discretisation
        ),
        observer=observer(parameters.observer.bandwidth, period) if watched else NO_OBSERVER,
        limits_errors=True,
        fades=fades,
        model=model,
    )


def _model(parameters: ControllerParameters, axis: str) -> InternalModel:
    shared, period = parameters.internal_model, parameters.sample_time
    multiples = getattr(parameters, axis).multiples
    frequencies = [multiple * shared.fundamental for multiple in multiples]
    model = internal_model(frequencies, shared.form, axis)
    if model.order and model.frequencies[-1] * period >= 0.5 * np.pi:
        raise ParameterError(
            f'{axis}: internal-model frequency {model.frequencies[-1]:g} rad/s is more than half '
            f'of what a sample time of {period:g} s can hold ({np.pi / period:g} rad/s)'
        )
    return model


def _gain(chosen: AxisParameters, model: InternalModel, period: float, axis: str) -> FloatArray:
    """K of (16)."""
    if chosen.design == 'poles':
        return place(model, poles_from(chosen.poles_real, chosen.poles_imaginary, axis), axis)
    weights = _weights(chosen, model, axis)
    if chosen.design == 'lqr_continuous':
        return lqr(model, weights, axis)
    return dlqr(model, weights, period, axis)


def _weights(chosen: AxisParameters, model: InternalModel, axis: str) -> Weights:
    if chosen.design != 'bandwidth':
        if chosen.weight_error == 0.0:
            raise ParameterError(
                f"{axis}: the design '{chosen.design}' takes 'weight_error' above 0, none is given"
            )
        return Weights(
            chosen.weight_error, chosen.weight_rate, chosen.weight_model, chosen.weight_effort
        )
    for name in ('weight_error', 'weight_rate', 'weight_model'):
        if getattr(chosen, name):
            raise ParameterError(
                f"{axis}: '{name}' is given, which the design 'bandwidth' does not take; give "
                "'bandwidth', 'integration' and 'learning', or set 'design' to 'lqr_discrete'"
            )
    if model.form != 'modal':
        raise ParameterError(
            f"{axis}: the design 'bandwidth' weighs integrator and oscillators, which an "
            f"'internal_model.form' of '{model.form}' does not tell apart: it takes 'modal'"
        )
    return bandwidth_weights(chosen.bandwidth, chosen.integration, chosen.learning)


def _paper_antiwindup(chosen: AxisParameters, model: InternalModel, axis: str) -> FloatArray:
    if len(chosen.antiwindup) not in (1, model.order) and model.order:
        raise ParameterError(
            f"{axis}: 'antiwindup' has {len(chosen.antiwindup)} elements, the internal model has "
            f'{model.order} states'
        )
    return np.broadcast_to(chosen.antiwindup, (model.order,)).astype(np.float64)
