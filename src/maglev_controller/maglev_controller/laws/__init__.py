"""The control laws, one module each: how the error of an axis becomes its virtual input w.

A law is, for every axis, a linear compensator in state space, run sampled by ``control_step``:
``w = k (e, ė) + κ ξ``, ``ξ⁺ = Φ ξ + N e + E (what was realised less what was wanted)``, and the
choice of inverse that makes currents from w.

To add another:

1. Write a module with two functions: ``check(parameters)`` raises
   :class:`~maglev_model.parameters.ParameterError` with the reason for choices that contradict the
   law, ``design(parameters, axis)`` gives the
   :class:`~maglev_controller.design.axis_design.AxisDesign` of the axis y, x, z, phi or theta. A
   transfer function needs no more than its zeros and poles, see ``feedback_lead_lag.py``. Two
   constants are optional: ``HAS_CROSSOVER = True`` where ``compensator.crossover`` sets the
   bandwidth, and ``REFERENCES``, the paper's references by number that the law is taken from.

   A law that is no such compensator has a function ``make(parameters)`` instead, which returns an
   object that is asked once a sample, see :class:`~maglev_controller.foreign_law.Law`; ``check`` is
   optional for it.
2. In this folder it is chosen by its name, ``law: my_law``; anywhere else where Python finds it, by
   its dotted path, ``law: my_package.my_law``.
3. To be compared with the others, it has a file ``params/laws/my_law.yaml``: ``law: my_law``, and
   what its authors would set.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

from maglev_controller.checks import check_currents, check_foreign, check_learning, check_machine
from maglev_controller.design.axis_design import AxisDesign
from maglev_controller.foreign_law import Law
from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters.plugins import find_plugin, plugin_function

_LANDS = 'output_regulator'


@dataclasses.dataclass(frozen=True)
class ControlLaw:
    """What the module of a law offers.

    Where it can ``make`` an object, ``design`` is that of the law which lands when this one fails.
    """

    check: Callable[[ControllerParameters], None]
    design: Callable[[ControllerParameters, str], AxisDesign]
    has_crossover: bool
    references: tuple[int, ...]
    make: Callable[[ControllerParameters], Law] | None = None


def find_law(name: str) -> ControlLaw:
    """The law of a name, or of the dotted path of its module.

    Raises :class:`ParameterError` when there is none, or when its module cannot be used.
    """
    module = find_plugin('law', name, (), __name__)
    function = functools.partial(plugin_function, 'law', name, package=__name__)
    references = getattr(module, 'REFERENCES', ())
    if callable(getattr(module, 'make', None)):
        check = function('check') if hasattr(module, 'check') else lambda _: None
        lands = find_law(_LANDS).design
        return ControlLaw(check, lands, False, references, function('make'))
    check, design = function('check'), function('design', gives=AxisDesign)
    has_crossover = getattr(module, 'HAS_CROSSOVER', False)
    return ControlLaw(check, design, has_crossover, references)


def control_law(parameters: ControllerParameters) -> ControlLaw:
    """The law that is chosen, checked against all other choices.

    Raises :class:`ParameterError` with the reason for a contradiction.
    """
    law = find_law(parameters.law)
    check_machine(parameters)
    check_currents(parameters)
    check_learning(parameters)
    law.check(parameters)
    if law.make is not None:
        check_foreign(parameters)
    return law
