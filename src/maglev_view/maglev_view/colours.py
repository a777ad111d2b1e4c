"""Colours, by red, green and blue from 0 to 1. No ROS here."""

from __future__ import annotations

import math

Colour = tuple[float, float, float]

STEEL: Colour = (0.45, 0.50, 0.55)
ALUMINIUM: Colour = (0.72, 0.77, 0.82)
IRON: Colour = (0.30, 0.34, 0.38)
MAGNET: Colour = (0.78, 0.33, 0.24)

AXIS_COLOURS = ('#0072b2', '#e69f00', '#009e73', '#cc79a7', '#d55e00')
"""Of y, x, z, phi, theta: apart to every eye."""

_COLD, _WARM, _HOT = (0.13, 0.40, 0.67), (0.97, 0.85, 0.55), (0.70, 0.09, 0.17)


def within(share: float) -> float:
    """A share of a limit, from 0 to 1; 1 where it is no number, as of a current that is none."""
    return 1.0 if math.isnan(share) else min(max(share, 0.0), 1.0)


def colour_of(share: float) -> Colour:
    """A colour for a share of a limit: blue at 0, pale at one half, red at 1 and above."""
    share = within(share)
    low, high = (_COLD, _WARM) if share < 0.5 else (_WARM, _HOT)
    part = 2.0 * share - (share >= 0.5)
    r, g, b = (a + part * (z - a) for a, z in zip(low, high, strict=True))
    return r, g, b
