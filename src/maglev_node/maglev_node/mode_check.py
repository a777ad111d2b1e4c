"""Whether stage, controller and reference run in one mode, and with one sample time."""

from __future__ import annotations

from typing import Any, Final

_ALIKE: Final = 1000  # two steps of stamps that differ by no more than this are steady [ns]
_APART: Final = 0.2  # share of our sample time; what is nearer may be a clock's steps


def mode_conflict(ours: str, lockstep: bool) -> str:
    """Why a node in mode ``ours`` cannot work with a stage that is in lockstep or not; '' if not.

    In real time the stage waits for nobody, in lockstep for every answer: mixed, samples would be
    lost or never come.
    """
    stage = 'lockstep' if lockstep else 'realtime'
    if ours == stage:
        return ''
    return (
        f"the stage runs in mode '{stage}', this node in mode '{ours}': start stage, controller and"
        " reference with one 'mode'"
    )


class SampleTimeCheck:
    """Whether the stage keeps our sample time, by the stamps of its samples.

    Currents and references that are meant for other moments do not hold a platen. A stage whose
    stamps are no steady steps, as a clock's, is believed.
    """

    def __init__(self, sample_time: float) -> None:
        """``sample_time`` is ours [s]."""
        self._ours = 1e9 * sample_time
        self._sequence = self._stamp = 0
        self._period = 0.0

    def conflict(self, sequence: int, stamp: int) -> str:
        """Take a sample and its stamp [ns]; why this node cannot work with the stage, or ''."""
        samples, elapsed = sequence - self._sequence, stamp - self._stamp
        if samples == 0:
            return ''
        period = elapsed / samples
        steady = abs(period - self._period) <= _ALIKE  # not with an activation, as time begins anew
        self._sequence, self._stamp, self._period = sequence, stamp, period
        if not steady or period <= 0.0 or abs(period - self._ours) <= _APART * self._ours:
            return ''
        return (
            f"the stage samples every {1e-6 * period:.6g} ms, this node's 'sample_time' is"
            f' {1e-6 * self._ours:.6g} ms: start stage, controller and reference with one'
            " 'sample_time'"
        )


class StageCheck:
    """Whether a node and the stage that it measures by can work together."""

    def __init__(self, mode: str, sample_time: float) -> None:
        """``mode`` and ``sample_time`` [s] are the node's."""
        self._mode, self._sample_time = mode, SampleTimeCheck(sample_time)

    def conflict(self, measurement: Any) -> str:
        """Take a measurement; why they cannot, or ''."""
        return mode_conflict(self._mode, measurement.lockstep) or self._sample_time.conflict(
            measurement.sequence, measurement.stamp
        )
