"""Numbers on a command line: what argparse makes them by, within bounds. No ROS here."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable


def whole_number(least: int, most: float = math.inf) -> Callable[[str], int]:
    """A ``type`` for a whole number from ``least`` to ``most``."""
    bounds = f'of at least {least}' if most == math.inf else f'from {least} to {most}'

    def check(text: str) -> int:
        if not text.isdecimal() or not least <= int(text) <= most:
            raise argparse.ArgumentTypeError(f"'{text}' is no whole number {bounds}")
        return int(text)

    return check


def number(least: float, most: float = math.inf, *, above: bool = False) -> Callable[[str], float]:
    """A ``type`` for a finite number from ``least`` to ``most``, or ``above`` the least alone."""
    bounds = f'from {least:g} to {most:g}'
    if most == math.inf:
        bounds = f'above {least:g}' if above else f'of at least {least:g}'

    def check(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not least <= value <= most or math.isinf(value) or (above and value == least):
            raise argparse.ArgumentTypeError(f"'{text}' is no finite number {bounds}")
        return value

    return check


positive = number(0.0, above=True)
not_negative = number(0.0)
count = whole_number(0)
