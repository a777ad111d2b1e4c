"""What a count is worth, shown by hand: shims under the platen, and its guides from end to end.

What the encoders see of a phase's current shows wiring, not scale, and a lift-off is measured by
the same encoders: twice as high as it should be it looks right.
"""

from __future__ import annotations

from collections.abc import Callable

from maglev_hw_bridge.commissioning.operators import SHIM, Act, Operator
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_model.axes import FloatArray

_TOLERANCE = 0.15  # of a length, for guides and shims that are not quite what they should be
_NOTHING = 0.05  # of a length: whoever sees less is not connected, which its phases show
_OFF = 5e-3  # the middle of the guides may read this [m]


def prove_scales(
    parameters: BridgeParameters, operator: Operator, read: Callable[[], FloatArray]
) -> bool:
    """Have the operator move a platen that is homed; ``read`` gives the lengths (6,) [m].

    Returns whether x and z each saw what the other was to: exchanged, or with everything else
    numbered 90 degrees round, which the phases tell. Raises WrongError.
    """
    rest = read()
    operator.act(Act.SHIMS)
    raised = rest - read()
    operator.act(Act.NO_SHIMS)
    for index in range(4):
        _compare(index, abs(raised[index]), SHIM, 'on shims of that')
    machine = parameters.machine
    across = True
    for index, stop, one, other in (
        (4, machine.x_max, Act.X_END, Act.X_OTHER_END),
        (5, machine.z_max, Act.Z_END, Act.Z_OTHER_END),
    ):
        operator.act(one)
        at_first = read().copy()
        operator.act(other)
        at_last = read().copy()
        first, last = at_first[index], at_last[index]
        name = ENCODER_NAMES[index]
        seen = abs(last - first)
        _compare(index, seen, 2.0 * stop, f"twice 'machine.{name}_max' from end to end")
        beside = abs(at_last[9 - index] - at_first[9 - index])
        across &= seen <= _NOTHING * stop and beside > stop
        middle = 0.5 * (first + last)
        if seen > _NOTHING * stop and abs(middle) > _OFF:
            raise WrongError(
                f'encoder {name} reads {middle * 1e3:.1f} mm in the middle of its guide: check '
                f'homing.{name}, and the sign of element {index} of encoder.direction'
            )
    return across


def _compare(index: int, seen: float, length: float, what: str) -> None:
    if seen > _NOTHING * length and abs(seen - length) > _TOLERANCE * length:
        raise WrongError(
            f'encoder {ENCODER_NAMES[index]} saw {seen * 1e3:.2f} mm of {length * 1e3:.2f} mm, '
            f'{what}: check element {index} of encoder.resolution'
        )
