"""Figures as people read them. No ROS here."""

from __future__ import annotations

_TILTS = ('phi', 'theta')


def number(value: float) -> str:
    """A figure with four digits; whole numbers in full."""
    return str(value) if isinstance(value, int) else f'{value:.4g}'


def angle_or_length(axis: str, value: float) -> str:
    """A position or error of an axis [m or rad] in mm or mrad, small ones in µm or µrad."""
    unit = 'rad' if axis in _TILTS else 'm'
    if value != 0.0 and abs(value) < 1e-3:
        return f'{number(value * 1e6)} µ{unit}'
    return f'{number(value * 1e3)} m{unit}'


def micro(axis: str, value: float | None) -> str:
    """An error of an axis [m or rad] in µm or µrad, one digit behind the point."""
    if value is None:
        return '–'
    return f'{value * 1e6:.1f} µ{"rad" if axis in _TILTS else "m"}'


def seconds(value: float | None) -> str:
    """A time [s], or that it was never reached."""
    return 'never' if value is None else f'{value:.3f} s'
