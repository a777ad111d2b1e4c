"""How the figures of all reports call and scale the axes. No ROS here."""

from __future__ import annotations

TITLES = {
    'y': 'air gap y',
    'x': 'displacement x',
    'z': 'displacement z',
    'phi': 'tilt φ',
    'theta': 'tilt θ',
}
FLOOR = 0.1  # of logarithmic error scales [µm, µrad]
MOVES = 1e-7  # a reference that moves less stands still [m, rad]


def units(axis: str) -> tuple[str, str]:
    """Units of an axis in thousandths and millionths."""
    return ('mrad', 'µrad') if axis in ('phi', 'theta') else ('mm', 'µm')
