"""The times under which messages go into a bag. No ROS here."""

from __future__ import annotations

import struct
from bisect import bisect_right
from collections.abc import Sequence

from maglev_model.contract.wire import KEY_OF_MESSAGE_TYPE
from maglev_monitor.metrics.decoding import decode

_STAMP = struct.Struct('<iI')  # of the header, behind the encapsulation
_HEADER = 4
_PATIENCE = 1_000_000_000  # [ns]

Timed = list[tuple[bytes, int]]
"""Serialized messages, each with a time [ns]."""


class LogTimes:
    """Times of reception; in lockstep, which has its own pace, stage time for all there is.

    For samples that is their own, for other messages that of the newest measurement when they came.
    Which of the two it is the first measurement says. Samples can overtake it: until it comes they
    are held back, a second of each topic at most.
    """

    def __init__(self) -> None:
        self._lockstep: bool | None = None
        self._measured: Timed = []  # by when they came: the newest, and the last before them
        self._held: dict[str, Timed] = {}

    def of(self, message_type: str, messages: Sequence[tuple[bytes, int]]) -> Timed:
        """Serialized messages of one topic, each with its time of reception [ns] or what is for it.

        Those held back before come first. Measurements therefore should be the first to be timed.
        """
        key = KEY_OF_MESSAGE_TYPE.get(message_type)
        if key == 'measurement' and messages:
            self._lockstep = bool(decode(key, [messages[-1][0]])['lockstep'][0])
            self._measured = [*self._measured[-1:], *messages]
        if key is None:
            return [(data, self._stage_time(received)) for data, received in messages]
        taken = [*self._held.pop(message_type, ()), *messages]
        if self._lockstep is None and taken and taken[-1][1] - taken[0][1] < _PATIENCE:
            self._held[message_type] = taken
            return []
        if not self._lockstep:
            return taken
        return [(data, _stamp(data) or received) for data, received in taken]

    def end(self) -> None:
        """No measurement comes any more: what is held back goes by when it came."""
        self._lockstep = bool(self._lockstep)

    def _stage_time(self, received: int) -> int:
        """Stage time when a message came; before the first sample it is the wall clock."""
        if not self._lockstep:
            return received
        before = bisect_right(self._measured, received, key=lambda each: each[1])
        return (_stamp(self._measured[before - 1][0]) if before else 0) or received


def _stamp(data: bytes) -> int:
    """The header's stamp [ns], 0 where there is none or it lies before all that a bag can tell."""
    seconds, nanoseconds = _STAMP.unpack_from(data, _HEADER)
    return max(int(seconds * 1_000_000_000 + nanoseconds), 0)
