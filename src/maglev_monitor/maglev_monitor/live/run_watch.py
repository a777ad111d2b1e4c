"""A run while it lasts: its figures, its progress, and what there is left to wait for. No ROS here.

Times are of a steady clock [s].
"""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from maglev_model.contract.wire import DecodeError
from maglev_model.parameters import parameter
from maglev_monitor.live.discovery import DiscoveryWatch
from maglev_monitor.live.progress import Progress
from maglev_monitor.live.silence import SilenceWatch
from maglev_monitor.metrics.decoding import Records, decode
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters

_END_GRACE = 0.5  # for the last messages of topics [s]
_LAG_GRACE = 4.0  # on top, for a topic that came and lags behind the end [s]


@dataclasses.dataclass(frozen=True, kw_only=True)
class WatchParameters(RunParameters):
    """The parameters of a run, and how long it is waited for."""

    start_timeout: float = parameter(
        60.0, 'longest wait for the run to begin; 0: for ever', unit='s', lower=0.0
    )
    timeout: float = parameter(
        20.0, 'longest silence of stage, controller or reference', unit='s', lower=0.1
    )
    fault_grace: float = parameter(
        3.0, 'how long a run is watched on after a fault', unit='s', lower=0.0
    )


class RunWatch:
    """Takes the messages of a run as they come, and who is there with ``discovery``."""

    def __init__(self, parameters: WatchParameters, discovery: DiscoveryWatch, now: float) -> None:
        self._parameters = parameters
        self._discovery = discovery
        self._waiting_since = now
        self._conclude_at: float | None = None
        self.result: dict[str, Any] | None = None
        """The content of ``metrics.json``, once the run was concluded."""
        self._begin(now)

    def _begin(self, now: float) -> None:
        self._joiner = Joiner()
        self._metrics = RunMetrics(self._parameters)
        self._progress = Progress(self._parameters)
        self._silence = SilenceWatch(now)
        self._last_measured = -1  # number of what came last, which need not be the newest

    @property
    def started(self) -> bool:
        """Whether the reference has left REST."""
        return self._metrics.started

    @property
    def dropped(self) -> int:
        """Samples that came too late to be counted."""
        return self._joiner.dropped

    def add(self, messages: Mapping[str, Sequence[bytes]]) -> None:
        """Take serialized messages by topic key. Raises DecodeError."""
        for key, part in messages.items():
            if part:
                records = decode(key, part)
                self._joiner.add(key, self._newer(records) if key == 'measurement' else records)
        for block in self._joiner.take():
            self._progress.add(self._metrics.add(block))

    def _newer(self, measured: Records) -> Records:
        """What one stage measures, which goes upwards: what does not is another's."""
        sequence = measured['sequence'].astype(np.int64)
        self._last_measured = int(sequence[-1])
        return measured[sequence > self._joiner.newest['measurement']]

    def add_fault(self, stamp: int, node: str, message: str, now: float) -> bool:
        """Take an error a node reported at a time [ns]; whether it is the first of the run."""
        self._metrics.add_fault(stamp, node, message)
        return self._has_failed(now)

    def over(self, now: float) -> bool:
        """Whether the run has ended, and what lags behind has come or had its time."""
        self._has_failed(now)
        end, newest = self._joiner.end, self._joiner.newest
        ended = end is not None and newest['measurement'] >= end
        if ended and self._conclude_at is None:
            self._conclude_at = now + _END_GRACE
        if ended and all(number > (end or 0) for number in newest.values()):
            return True
        lags = ended and any(0 <= number < (end or 0) for number in newest.values())
        grace = _LAG_GRACE if lags else 0.0
        return self._conclude_at is not None and now > self._conclude_at + grace

    def _has_failed(self, now: float) -> bool:
        """Whether a fault of the run is known for the first time."""
        if self._conclude_at is not None or not self._metrics.failed:
            return False
        self._conclude_at = now + self._parameters.fault_grace
        return True

    def line(self, now: float) -> str:
        """One line of progress; also keeps who has been silent since when."""
        newest = self._joiner.newest
        self._silence.update(newest, now)
        return self._progress.line(newest['measurement'], self._metrics.phase, now)

    def progress(self) -> dict[str, object]:
        """What the last line said, by name."""
        return self._progress.values()

    def given_up(self, publishers: Mapping[str, int], now: float) -> str:
        """Why there is nothing left to wait for, empty while there is.

        A stage that begins anew ends a run; before there is one, it is waited for from there.

        :param publishers: how many publish each topic, by key.
        """
        waited = now - self._waiting_since
        before = self._joiner.newest['measurement']
        if self._last_measured < before and publishers['measurement'] == 1:
            if self.started:
                return f'the run has stopped: the stage began anew after sample {before}'
            self._begin(now)
        if self.started:
            if self._silence.longest(now)[1] > self._parameters.timeout:
                return f'the run has stopped: {self._silence.blame(publishers, now)}'
        elif 0.0 < self._parameters.start_timeout < waited:
            blame = self._silence.blame(publishers, now)
            if not self._discovery.seen:
                blame = self._discovery.nobody()
            return f'no run has begun within {waited:.0f} s: {blame}'
        return ''

    def conclude(self, last: Mapping[str, Sequence[bytes]] | None = None) -> dict[str, Any]:
        """The figures of the run, with the last messages; once, the same ever after."""
        if self.result is None:
            with contextlib.suppress(DecodeError):
                self.add(last or {})
            for block in self._joiner.finish():
                self._progress.add(self._metrics.add(block))
            self.result = self._metrics.result()
        return self.result
