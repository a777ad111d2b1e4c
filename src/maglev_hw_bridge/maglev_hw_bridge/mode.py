"""What the bridge does."""

from __future__ import annotations

import enum


class Mode(enum.Enum):
    """The amplifiers are enabled while it follows or lands, and at no other time."""

    CLOSED = 'closed'
    READY = 'boards open, no current'
    FOLLOWING = 'following the controller'
    LANDING = 'landing by itself'
    DISABLED = 'no current, amplifiers disabled'
    LOST = 'the boards are lost'
