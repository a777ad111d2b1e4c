"""Feedback linearisation with lead-lag compensators, after Kim and co-workers, refs. [3]-[5].

The inverse makes every axis a double integrator; a lead for damping and a lag with a free
integrator against constant forces close the loop.
"""

from __future__ import annotations

from maglev_controller.checks import check_compensator, check_inverse
from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.design.loop_shaping import lead_lag, shaped_axis
from maglev_controller.parameters import ControllerParameters

REFERENCES = (3, 4, 5)
HAS_CROSSOVER = True


def check(parameters: ControllerParameters) -> None:
    """Needs double integrators."""
    check_inverse(parameters, linear=False)
    check_compensator(parameters)


def design(parameters: ControllerParameters, axis: str) -> AxisDesign:
    """The lead that gives the phase margin at the crossover."""
    return shaped_axis(parameters, axis, lead_lag, stiffness=0.0)
