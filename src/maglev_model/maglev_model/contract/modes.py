"""What a controller is doing."""

from __future__ import annotations

import enum


class Mode(enum.IntEnum):
    """The values of ``ControllerState.mode``."""

    DISABLED = 0  # no current
    WAITING = 1  # enabled, no current wanted
    REGULATING = 2
    LANDING = 3  # by itself
    FAULT = 4  # latched, no current
