"""Contradictions between the choices of parameters, which the laws refuse."""

from __future__ import annotations

import math

from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.voltage import USED
from maglev_model.machine import machine_constants
from maglev_model.motor import attraction_coefficients
from maglev_model.parameters import ParameterError


def check_machine(parameters: ControllerParameters) -> None:
    """Refuse control of what the machine with a single motor cannot move."""
    if parameters.machine.motors == 4:
        return
    names = ('z', 'phi', 'theta')
    moved = [name for name in names if getattr(parameters, name).controlled]
    if moved:
        raise ParameterError(
            f"parameter '{moved[0]}.controlled' is true, but a machine with a single motor moves "
            'in y and x only'
        )
    if parameters.inverse != 'exact':
        raise ParameterError(
            f"parameter 'inverse' is '{parameters.inverse}', a machine with a single motor has "
            "'exact' only"
        )


def check_currents(parameters: ControllerParameters) -> None:
    """Refuse currents that cannot hold the platen off the upper stop: the magnets would have it."""
    machine = machine_constants(parameters.machine)
    pull, per_ampere, _ = attraction_coefficients(machine, parameters.machine.gap_min)
    least = (pull - math.sqrt(machine.M_y * machine.G / machine.motors)) / per_ampere
    voltage = least * parameters.winding.resistance / USED
    for name, given, bound, unit in (
        ('limits.current', parameters.limits.current, least, 'A'),
        ('winding.voltage', parameters.winding.voltage or math.inf, voltage, 'V'),
    ):
        if given < bound:
            raise ParameterError(
                f"parameter '{name}' is {given:g} {unit}, but to hold the platen off the upper stop"
                f' it must be at least {bound:.6g} {unit}'
            )


def check_inverse(parameters: ControllerParameters, *, linear: bool) -> None:
    """A law that linearises by feedback takes a nonlinear inverse, one by Jacobian the other."""
    law, inverse = parameters.law, parameters.inverse
    if linear and inverse != 'equilibrium':
        raise ParameterError(
            f"parameter 'inverse' is '{inverse}', but the law '{law}' is designed for the plant "
            "linearised about an equilibrium: it takes 'equilibrium'"
        )
    if not linear and inverse == 'equilibrium':
        raise ParameterError(
            f"parameter 'inverse' is 'equilibrium', but the law '{law}' is designed for double "
            "integrators, which only feedback linearisation makes: it takes 'exact' or 'simplified'"
        )


def check_learning(parameters: ControllerParameters) -> None:
    """Refuse to learn what is not fed forward then."""
    if parameters.learning.period > 0.0 and not parameters.feed_forward:
        raise ParameterError(
            "parameter 'feed_forward' is false: what is learned ('learning.period') is fed forward"
        )


def check_foreign(parameters: ControllerParameters) -> None:
    """Refuse what the law that lands in place of somebody else's has not, and too much time."""
    if parameters.inverse == 'equilibrium':
        raise ParameterError(
            "parameter 'inverse' is 'equilibrium', but the regulator lands by itself when the law "
            f"'{parameters.law}' fails, and for that takes 'exact' or 'simplified'"
        )
    if parameters.learning.period > 0.0:
        raise ParameterError(
            f"parameter 'learning.period' is {parameters.learning.period:g} s, but what is learned "
            f"is fed forward by the regulator's own laws, not by '{parameters.law}': it takes 0"
        )
    if parameters.foreign.time > parameters.sample_time:
        raise ParameterError(
            f"parameter 'foreign.time' is {parameters.foreign.time:g} s, it must not be more than "
            f"'sample_time' ({parameters.sample_time:g} s)"
        )


def check_compensator(parameters: ControllerParameters) -> None:
    """Refuse what belongs to the internal model and means nothing to a compensator."""
    if parameters.internal_model.antiwindup == 'paper':
        raise ParameterError(
            "parameter 'internal_model.antiwindup' is 'paper', equation (17), which is about "
            f"internal models; the law '{parameters.law}' has none: it takes 'observer' or 'none'"
        )
    if parameters.rate_estimate == 'observer':
        raise ParameterError(
            f"parameter 'rate_estimate' is 'observer', but the law '{parameters.law}' feeds back "
            "no rate: it takes 'derivative', which it leaves unused"
        )
    if parameters.internal_model.restart_at_step:
        raise ParameterError(
            "parameter 'internal_model.restart_at_step' is true: the law "
            f"'{parameters.law}' has no internal model, and its integrator carries the weight's "
            'remainder, which must not be lost in flight'
        )
