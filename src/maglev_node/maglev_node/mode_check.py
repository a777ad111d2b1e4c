"""Whether stage, controller and reference run in one mode, and with one sample time."""

from __future__ import annotations

from typing import Any, Final

_ALIKE: Final = 1000  # two steps of stamps that differ by no more than this are steady [ns]
_STEADY: Final = 5  # such pairs in a row are no chance
_APART: Final = 0.05  # share of our sample time; what is nearer may be a clock's steps


class StageCheck:
    """Whether a node and the stage that it measures by can work together.

    In real time the stage waits for nobody, in lockstep for every answer: mixed, samples would be
    lost or never come. Currents and references that are meant for other moments do not hold a
    platen; the sample time is told by the stamps. A stage whose stamps are no steady steps, as a
    clock's, is believed.
    """

    def __init__(self, mode: str, sample_time: float) -> None:
        """``mode`` and ``sample_time`` [s] are the node's."""
        self._mode, self._ours = mode, 1e9 * sample_time
        self._sequence = self._stamp = 0
        self._period = 0.0  # of the sample before [ns]
        self._alike = 0  # steps in a row

    def conflict(self, measurement: Any) -> str:
        """Take a measurement; why they cannot, or ''."""
        stage = 'lockstep' if measurement.lockstep else 'realtime'
        if stage != self._mode:
            return (
                f"the stage runs in mode '{stage}', this node in mode '{self._mode}': start stage,"
                " controller and reference with one 'mode'"
            )
        samples = measurement.sequence - self._sequence
        if samples == 0:
            return ''
        period = (measurement.stamp - self._stamp) / samples
        alike = abs(period - self._period) <= _ALIKE  # not with an activation, as time begins anew
        self._alike = self._alike + 1 if alike else 0
        self._sequence, self._stamp, self._period = measurement.sequence, measurement.stamp, period
        steady, apart = self._alike >= _STEADY, abs(period - self._ours) > _APART * self._ours
        if not steady or period <= 0.0 or not apart:
            return ''
        return (
            f"the stage samples every {1e-6 * period:.6g} ms, this node's 'sample_time' is"
            f' {1e-6 * self._ours:.6g} ms: start stage, controller and reference with one'
            " 'sample_time'"
        )
