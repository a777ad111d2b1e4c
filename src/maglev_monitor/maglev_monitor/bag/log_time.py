"""The times under which messages go into a bag. No ROS here."""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Sequence

from maglev_monitor.metrics.decoding import KEY_OF_MESSAGE_TYPE, decode

_STAMP = struct.Struct('<iI')  # of the header, behind the encapsulation
_HEADER = 4

Timed = list[tuple[bytes, int]]
"""Serialized messages, each with a time [ns]."""


class LogTimes:
    """Times of reception; in lockstep, which has its own pace, stage time for all there is.

    For samples that is their own, for other messages that of the newest measurement when they came.
    """

    def __init__(self) -> None:
        self._lockstep = False
        self._measured: Timed = []  # by when they came: the newest, and the last before them

    def of(self, message_type: str, messages: Sequence[tuple[bytes, int]]) -> Timed:
        """Serialized messages of one topic, each with its time of reception [ns] or what is for it.

        Whether the stage is in lockstep its measurements say, which therefore should come first.
        """
        key = KEY_OF_MESSAGE_TYPE.get(message_type)
        if key == 'measurement':
            self._lockstep = bool(decode(key, [messages[-1][0]])['lockstep'][0])
            self._measured = [*self._measured[-1:], *messages]
        if not self._lockstep:
            return list(messages)
        if key is None:
            return [(data, self._stage_time(received)) for data, received in messages]
        return [(data, _stamp(data) or received) for data, received in messages]

    def _stage_time(self, received: int) -> int:
        """Stage time when a message came; before the first sample it is the wall clock."""
        before = bisect_right(self._measured, received, key=lambda each: each[1])
        return (_stamp(self._measured[before - 1][0]) if before else 0) or received


def _stamp(data: bytes) -> int:
    """The header's stamp [ns], 0 where there is none."""
    seconds, nanoseconds = _STAMP.unpack_from(data, _HEADER)
    return int(seconds * 1_000_000_000 + nanoseconds)
