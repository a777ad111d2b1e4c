"""The times under which messages go into a bag. No ROS here."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from maglev_monitor.metrics.decoding import KEY_OF_MESSAGE_TYPE, decode

_STAMP = struct.Struct('<iI')  # of the header, behind the encapsulation
_HEADER = 4


class LogTimes:
    """Times of reception; for samples in lockstep, which has its own pace, their stage time."""

    def __init__(self) -> None:
        self._lockstep = False

    def of(
        self, message_type: str, messages: Sequence[tuple[bytes, int]]
    ) -> list[tuple[bytes, int]]:
        """Serialized messages of one topic, each with its time of reception [ns] or what is for it.

        Whether the stage is in lockstep its measurements say, which therefore should come first.
        """
        key = KEY_OF_MESSAGE_TYPE.get(message_type)
        if key == 'measurement':
            self._lockstep = bool(decode(key, [messages[-1][0]])['lockstep'][0])
        if key is None or not self._lockstep:
            return list(messages)
        return [(data, _stamp(data) or received) for data, received in messages]


def _stamp(data: bytes) -> int:
    """The header's stamp [ns], 0 where there is none."""
    seconds, nanoseconds = _STAMP.unpack_from(data, _HEADER)
    return int(seconds * 1_000_000_000 + nanoseconds)
