"""The notches of an axis, a sample at a time."""

from __future__ import annotations

from maglev_controller.step.arrays import Record
from maglev_model.compiled import borrowing


@borrowing
def notched(settings: Record, axis: Record, index: int, value: float) -> float:
    """``value`` after all notches of an axis; moves their states on."""
    for k in range(settings.notches[index]):
        each = settings.notch[index, k]
        b_0, b_1, b_2, a_1, a_2 = each[0], each[1], each[2], each[3], each[4]
        out = b_0 * value + axis.notch[k, 0]
        axis.notch[k, 0] = b_1 * value - a_1 * out + axis.notch[k, 1]
        axis.notch[k, 1] = b_2 * value - a_2 * out
        value = out
    return value
