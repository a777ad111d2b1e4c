"""What can be wrong with a bag, and how the tools say what is wrong. No ROS here."""

from __future__ import annotations

import sys


class BagError(RuntimeError):
    """The bag cannot be written or read; the message says why and what to do."""


def refuse(program: str, reason: object, code: int) -> int:
    """Say in a line why a program does not do what is asked; its exit code."""
    print(f'{program}: error: {reason}', file=sys.stderr)
    return code
