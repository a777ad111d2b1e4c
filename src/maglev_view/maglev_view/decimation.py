"""Which samples are shown. No ROS here."""

from __future__ import annotations


class Decimation:
    """Lets one sample through in each period of stage time.

    :param rate: how many [Hz].
    """

    def __init__(self, rate: float) -> None:
        self._period = round(1e9 / rate)
        self._last: int | None = None

    def due(self, stamp: int) -> bool:
        """Whether a sample at a stage time [ns] is the first one of its period that is seen.

        A stage that begins anew, with a time before the last, is followed.
        """
        period = stamp // self._period
        if period == self._last:
            return False
        self._last = period
        return True
