"""Time stamps for the 1 kHz loop, without a clock object or a new message."""

from __future__ import annotations

from builtin_interfaces.msg import Time


def set_stamp(stamp: Time, nanoseconds: int) -> None:
    """Set a message's stamp to a time since the epoch [ns]."""
    stamp.sec, stamp.nanosec = divmod(nanoseconds, 1_000_000_000)


def nanoseconds(stamp: Time) -> int:
    """A stamp as time since the epoch [ns]."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
