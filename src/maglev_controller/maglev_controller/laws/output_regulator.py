"""The internal-model regulator (14)-(17): the paper's own, and with more frequencies the default.

Feedback linearisation by either inverse; state feedback of e, ė and an internal model of what is to
be tracked or rejected. ``params/paper.yaml`` makes it the paper's to the letter.
"""

from __future__ import annotations

from maglev_controller.design.gains import AxisDesign, design_axis
from maglev_controller.laws.checks import check_inverse
from maglev_controller.parameters import ControllerParameters


class InternalModelRegulator:
    """The law ``internal_model``."""

    def check(self, parameters: ControllerParameters) -> None:
        """Needs double integrators."""
        check_inverse(parameters, linear=False)

    def design(self, parameters: ControllerParameters, axis: str) -> AxisDesign:
        """Gains from poles or weights, see :func:`~.design.design_axis`."""
        return design_axis(parameters, axis)
