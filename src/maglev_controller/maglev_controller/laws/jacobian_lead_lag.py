"""Jacobian linearisation about an equilibrium with lead-lag compensators, after Kim and Trumper,
refs. [1], [2].

The plant is linearised once, at ``compensator.equilibrium`` with level platen; constant gains
decouple the axes there, and each lead-lag compensator is designed for its own linear plant,
``1 / (s² - α)``: unstable in y and theta, stiff in phi.
"""

from __future__ import annotations

from maglev_controller.checks import check_compensator, check_inverse
from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.design.loop_shaping import lead_lag, shaped_axis
from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES
from maglev_model.equilibrium import stiffness
from maglev_model.machine import machine_constants
from maglev_model.parameters import ParameterError

REFERENCES = (1, 2)
HAS_CROSSOVER = True


def check(parameters: ControllerParameters) -> None:
    """Needs an equilibrium between the stops, and the constant gains there."""
    check_inverse(parameters, linear=True)
    check_compensator(parameters)
    gap, machine = parameters.compensator.equilibrium, parameters.machine
    if not machine.gap_min < gap < machine.gap_max:
        raise ParameterError(
            f"parameter 'compensator.equilibrium' is {gap:g} m, it must lie between the stops, "
            f'({machine.gap_min:g}, {machine.gap_max:g}) m'
        )
    if machine.gravity == 0.0:
        raise ParameterError(
            "parameter 'machine.gravity' is 0: without weight nothing attracts at the equilibrium, "
            'and a small current changes nothing there'
        )


def design(parameters: ControllerParameters, axis: str) -> AxisDesign:
    """The lead that gives the phase margin at the crossover, with the axis' own stiffness."""
    machine = machine_constants(parameters.machine)
    alpha = stiffness(machine, parameters.compensator.equilibrium)[AXES.index(axis)]
    return shaped_axis(parameters, axis, lead_lag, stiffness=alpha)
