"""Figures as people read them. No ROS here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_SHOWN = 4  # holes of a topic
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
    shown = round(value * 1e6, 1) + 0.0  # not -0.0
    return f'{shown:.1f} µ{"rad" if axis in _TILTS else "m"}'


def saturation(currents: Mapping[str, Any]) -> str:
    """How many samples were saturated, and by what where that is known."""
    causes = [f'{count} by {limit}' for limit, count in currents['saturated_by'].items() if count]
    why = f' ({", ".join(causes)})' if causes else ''
    count = currents['saturated_samples']
    return f'{count} {"sample" if count == 1 else "samples"} saturated{why}'


def holes(by_topic: Mapping[str, Any]) -> str:
    """Which topics have holes, how many, and from which sample to which the first ones go."""
    return '; '.join(_holes_of(topic, found) for topic, found in by_topic.items())


def _holes_of(topic: str, found: Mapping[str, Any]) -> str:
    count, places = found['count'], found['samples']
    shown = [f'{a}' if a == b else f'{a}–{b}' for a, b in places[:_SHOWN]]
    more = f' and {count - _SHOWN} more' if count > _SHOWN else ''
    return f'{topic} in {count} {"hole" if count == 1 else "holes"}: {", ".join(shown)}{more}'


def seconds(value: float | None) -> str:
    """A time [s], or that it was never reached."""
    return 'never' if value is None else f'{value:.3f} s'
