"""Time stamps for the 1 kHz loop."""

from __future__ import annotations

import time

from builtin_interfaces.msg import Time


def stamp_now(stamp: Time) -> None:
    """Set a message's stamp to the wall clock, without a clock object or a new message."""
    stamp.sec, stamp.nanosec = divmod(time.time_ns(), 1_000_000_000)


def seconds(stamp: Time) -> float:
    """A stamp as seconds since the epoch."""
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def copy_stamp(source: Time, target: Time) -> None:
    """Give one message the stamp of another."""
    target.sec, target.nanosec = source.sec, source.nanosec
