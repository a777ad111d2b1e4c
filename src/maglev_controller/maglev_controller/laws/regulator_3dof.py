"""The 3DOF regulator of the paper's ref. [11]: y, x and z regulated, the tilts left alone.

Internal models on the three displacements, all normal forces equal; what keeps the platen level are
stoppers, the plant's ``guide.locked``. The paper's published gains for y, x and z were chosen to
match it.
"""

from __future__ import annotations

from maglev_controller.checks import check_inverse
from maglev_controller.laws import output_regulator
from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters import ParameterError

REFERENCES = (11,)


def check(parameters: ControllerParameters) -> None:
    """Refuse control of the tilts."""
    check_inverse(parameters, linear=False)
    for name in ('phi', 'theta'):
        if getattr(parameters, name).controlled:
            raise ParameterError(
                f"parameter '{name}.controlled' is true, but the law 'regulator_3dof' leaves "
                'the tilts to stoppers (lock phi and theta of the stage): set it to false'
            )


design = output_regulator.design
"""The tilts' gains are not used."""
