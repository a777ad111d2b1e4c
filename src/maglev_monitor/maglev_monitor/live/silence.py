"""Who on the graph has gone silent, and what to say about it. No ROS here."""

from __future__ import annotations

from collections.abc import Mapping

REQUIRED = ('measurement', 'currents', 'reference')
"""Topics without which there is no run."""

_NODES = {'measurement': 'the stage', 'currents': 'the controller', 'reference': 'the reference'}


class SilenceWatch:
    """Keeps when each topic last brought a new sample.

    :param now: time on a steady clock [s].
    """

    def __init__(self, now: float) -> None:
        self._newest = dict.fromkeys(REQUIRED, -1)
        self._since = dict.fromkeys(REQUIRED, now)

    def update(self, newest: Mapping[str, int], now: float) -> None:
        """Take the highest sample number of each topic."""
        for key in REQUIRED:
            if newest[key] > self._newest[key]:
                self._newest[key] = newest[key]
                self._since[key] = now

    def longest(self, now: float) -> tuple[str, float]:
        """The topic that has been silent longest, where the loop broke first; for how long [s]."""
        key = min(REQUIRED, key=lambda name: self._since[name])
        return key, now - self._since[key]

    def blame(self, publishers: Mapping[str, int], now: float) -> str:
        """Who is missing or silent, in one line.

        :param publishers: how many publish each of the required topics.
        """
        missing = [_NODES[key] for key in REQUIRED if not publishers[key]]
        never = [_NODES[key] for key in REQUIRED if publishers[key] and self._newest[key] < 0]
        if missing:
            return f'{" and ".join(missing)} {"is" if len(missing) == 1 else "are"} not running'
        if never:
            return f'{" and ".join(never)} never published a sample'
        key, duration = self.longest(now)
        return (
            f'{_NODES[key]} has been silent for {duration:.1f} s, since sample {self._newest[key]}'
        )
