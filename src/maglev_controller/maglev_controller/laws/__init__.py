"""The control laws, one small file each: how the error of an axis becomes its virtual input w.

A law is, for every axis, a linear compensator in state space, run sampled by ``law.control_step``:
``w = D e + k ė + κ ξ``, ``ξ⁺ = Φ ξ + N e + E (what was realised less what was wanted)``, and the
choice of inverse that makes currents from w.

To add another:

1. Write ``laws/my_law.py`` with a class that has the two methods of :class:`ControlLaw`: ``check``
   refuses what contradicts the law, ``design`` gives the :class:`~.design.AxisDesign` of one axis.
   A transfer function needs no more than its zeros and poles, see ``feedback_lead_lag.py``.
2. Enter it in :data:`CONTROL_LAWS` below, and its name in ``parameters.LAWS``.
3. If it has figures of its own, give them a group in ``parameters.py`` (and ``controller.yaml``).
4. Write ``params/laws/my_law.yaml``: ``law: my_law``, and what its authors would set.

Node, compiled loop, checks and ``scenarios/compare.sh`` take it from there.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from maglev_controller.design.gains import AxisDesign
from maglev_controller.laws.checks import check_machine
from maglev_controller.laws.feedback_lead_lag import FeedbackLeadLag
from maglev_controller.laws.feedback_soi import FeedbackSecondOrderIntegral
from maglev_controller.laws.jacobian_lead_lag import JacobianLeadLag
from maglev_controller.laws.output_regulator import InternalModelRegulator
from maglev_controller.laws.regulator_3dof import Regulator3DOF
from maglev_controller.parameters import ControllerParameters


class ControlLaw(Protocol):
    """What a law has to have."""

    def check(self, parameters: ControllerParameters) -> None:
        """Raise :class:`ParameterError` with the reason for choices that contradict the law."""

    def design(self, parameters: ControllerParameters, axis: str) -> AxisDesign:
        """Design the axis named ``axis``: y, x, z, phi or theta.

        Raises :class:`ParameterError`, naming the axis and the reason, for what cannot be had.
        """


CONTROL_LAWS: Mapping[str, ControlLaw] = {
    'output_regulator': InternalModelRegulator(),
    'jacobian_lead_lag': JacobianLeadLag(),
    'feedback_lead_lag': FeedbackLeadLag(),
    'feedback_soi': FeedbackSecondOrderIntegral(),
    'regulator_3dof': Regulator3DOF(),
}
"""The laws by name, as the parameter ``law`` takes it."""


def control_law(parameters: ControllerParameters) -> ControlLaw:
    """The law that is chosen, checked against all other choices.

    Raises :class:`ParameterError` with the reason for a contradiction.
    """
    law = CONTROL_LAWS[parameters.law]
    check_machine(parameters)
    law.check(parameters)
    return law
