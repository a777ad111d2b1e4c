"""Faults in words: what happened and what to do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge import amplifiers, guard
from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.guard import Guard
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES, PHASE_NAMES
from maglev_model.axes import AXES

FloatArray = NDArray[np.float64]


class Fault(NamedTuple):
    """A latched fault."""

    kind: str  # a word
    reason: str  # what happened
    remedy: str  # what to do
    cut: bool  # whether the current was cut at once

    def __str__(self) -> str:
        action = 'currents cut' if self.cut else 'landed by the bridge'
        return f'{self.reason} ({action}); {self.remedy}, then call ~/reset'


def range_fault(code: int, index: int, watched: Guard) -> tuple[str, str]:
    """Reason and remedy of a platen out of its soft range, by the code of ``watch``."""
    if code == guard.RANGE:
        name, value = AXES[index], watched.arrays.position[index]
        unit = 'mm' if index < 3 else 'mrad'
    else:
        name, value, unit = ENCODER_NAMES[index], watched.arrays.past[0, index], 'mm'
    return f'{name} is {value * 1e3:.3f} {unit}, outside its soft range', 'check the reference'


def encoder_fault(code: int, index: int, watched: Guard) -> tuple[str, str]:
    """Reason and remedy of encoders that cannot be believed, by the code of ``watch``."""
    if code == guard.RESIDUAL:
        reason = f'the gaps contradict each other by {watched.residual * 1e6:.0f} um'
        return reason, 'check the gap encoders, home again'
    name = ENCODER_NAMES[index]
    if code == guard.JUMP:
        return f'encoder {name} jumped', 'check its cable, home again'
    return f'encoder {name} is stuck, or its motors are', 'check its cable and the phases'


def command_fault(
    code: int, index: int, i_d: FloatArray, i_q: FloatArray, amplifier: Amplifiers
) -> tuple[str, str]:
    """Reason and remedy of what the amplifiers refused, by the code of ``drive``."""
    if code == amplifiers.NOT_FINITE:
        return (
            f'i_d, i_q of motor {index + 1} are {i_d[index]}, {i_q[index]}: they must be finite',
            'see to the controller',
        )
    if code == amplifiers.OVER_LIMIT:
        amplitude = float(np.hypot(i_d[index], i_q[index]))
        return f'motor {index + 1} was commanded {amplitude:.1f} A', 'see to the controller'
    if code == amplifiers.OVER_CURRENT:
        current = float(amplifier.arrays.wanted[index])
        return f'{PHASE_NAMES[index]} was to carry {current:.1f} A', 'see to the controller'
    return (
        f'{PHASE_NAMES[index]} has spent its I2t budget (load {amplifier.load:.2f})',
        'let the amplifiers cool',
    )
