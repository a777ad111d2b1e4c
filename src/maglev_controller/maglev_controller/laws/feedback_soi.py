"""Feedback linearisation with loop-shaped second-order-plus-integral compensators, after Menq and
co-workers, refs. [6]-[9].

The inverse makes every axis a double integrator. Shaped by hand is its loop gain: an integral below
the crossover, a zero for the phase around it, and a second-order roll-off above it that keeps the
encoders' noise from the currents.
"""

from __future__ import annotations

from maglev_controller.checks import check_compensator, check_inverse
from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.design.loop_shaping import second_order_integral, shaped_axis
from maglev_controller.parameters import ControllerParameters

REFERENCES = (6, 7, 8, 9)
HAS_CROSSOVER = True


def check(parameters: ControllerParameters) -> None:
    """Needs double integrators."""
    check_inverse(parameters, linear=False)
    check_compensator(parameters)


def design(parameters: ControllerParameters, axis: str) -> AxisDesign:
    """The zero that gives the phase margin at the crossover."""
    return shaped_axis(parameters, axis, second_order_integral, stiffness=0.0)
