"""The derivative filter s·a / (s + a) that estimates rates from encoder positions.

Sampled with period T it is d = g (e − f), f⁺ = f + c (e − f), one state f. At the first sample f =
e, so the estimate starts at zero, whatever the error is: no kick at enable.
"""

from __future__ import annotations

import math
from typing import NamedTuple


class DerivativeFilter(NamedTuple):
    """g [1/s] and c of d = g (e − f), f⁺ = f + c (e − f)."""

    gain: float
    forget: float


def derivative_filter(bandwidth: float, period: float, discretisation: str) -> DerivativeFilter:
    """Coefficients for the filter with ``bandwidth`` a [rad/s] at sample time ``period`` T [s].

    ``tustin``: s = 2 (z − 1) / (T (z + 1)). ``matched``: the pole at exp(−a T), where the filter
    has it, and the slope of a ramp exact. In both c = g T, so a ramp's slope is estimated without
    bias.
    """
    if discretisation == 'tustin':
        gain = 2.0 * bandwidth / (2.0 + bandwidth * period)
        return DerivativeFilter(gain, gain * period)
    forget = -math.expm1(-bandwidth * period)
    return DerivativeFilter(forget / period, forget)
