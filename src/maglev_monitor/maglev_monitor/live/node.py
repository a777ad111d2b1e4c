"""The monitor node: progress while a run lasts, its figures and verdict at its end."""

from __future__ import annotations

import contextlib
import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from maglev_model.parameters import parameter
from maglev_monitor.live.progress import Progress
from maglev_monitor.live.silence import SilenceWatch
from maglev_monitor.metrics.decoding import DecodeError, decode
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.result_file import write_metrics
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import FAULT_LEVEL, RUN_KEY, RunParameters, run_to_json
from maglev_monitor.report.terminal import as_text
from maglev_node import topics
from maglev_node.node import MaglevNode, NodeError, NodeParameters
from maglev_node.polling import PolledSubscription, Queues
from maglev_node.process import main as run_main
from maglev_node.stamp import seconds

KEYS = {
    topics.REFERENCE: 'reference',
    topics.MEASUREMENT: 'measurement',
    topics.CURRENTS: 'currents',
    topics.CONTROLLER_STATE: 'controller',
    topics.TRUE_STATE: 'plant',
}
"""Keys of a run's topics."""

_POLL_PERIOD = 0.05
_END_GRACE = 0.5  # for the last messages of topics that lag behind [s]


@dataclasses.dataclass(frozen=True, kw_only=True)
class MonitorParameters(NodeParameters, RunParameters):
    """The monitor's parameters."""

    output: str = parameter('', description='file for metrics.json; empty: none')
    exit_at_end: bool = parameter(
        True, description='leave when the run has ended: 0 when it passed, 1 otherwise'
    )
    start_timeout: float = parameter(
        60.0, unit='s', lower=0.0, description='longest wait for the run to begin; 0: for ever'
    )
    timeout: float = parameter(
        10.0, unit='s', lower=0.1, description='longest silence of stage, controller or reference'
    )
    fault_grace: float = parameter(
        3.0, unit='s', lower=0.0, description='how long a run is watched on after a fault'
    )


class MonitorNode(MaglevNode[MonitorParameters]):
    """Takes the samples of all topics in bursts; polls, so that the loop keeps the cores."""

    def __init__(self) -> None:
        super().__init__('monitor', MonitorParameters)
        self._check_output()
        self._joiner = Joiner()
        self._metrics = RunMetrics(self.parameters)
        self._waiting_since = time.monotonic()
        self._watch = SilenceWatch(self._waiting_since)
        self._progress = Progress(self.parameters)
        self._run_json = run_to_json(self.parameters)
        self._conclude_at: float | None = None
        self._concluded = False
        self._verdict = ''
        self._queues = Queues(self)
        self._taps: dict[str, PolledSubscription] = {
            topic: self._queues.subscribe(topic, topics.SAMPLE_TOPICS[topic], raw=True)
            for topic in KEYS
        }
        self.create_subscription(DiagnosticArray, topics.DIAGNOSTICS, self._on_diagnostics, 100)
        self.create_timer(_POLL_PERIOD, self._poll, clock=self.steady_clock)
        self.create_timer(1.0, self._each_second, clock=self.steady_clock)

    def close(self) -> None:
        """Leave the figures of a run that was broken off."""
        if not self._concluded:
            with contextlib.suppress(DecodeError):
                self._drain()
            self._conclude()
        self._queues.destroy()

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """The state of the run, and its parameters for the bag."""
        values = {**self._progress.values(), RUN_KEY: self._run_json}
        if self._concluded:
            return DiagnosticStatus.OK, 'the run has ended', values
        if not self._metrics.started:
            return DiagnosticStatus.OK, 'waiting for the run to begin', values
        if self._joiner.dropped:
            values['dropped_samples'] = self._joiner.dropped
            return DiagnosticStatus.WARN, 'samples came too late to be counted', values
        return DiagnosticStatus.OK, 'the run is on', values

    def _check_output(self) -> None:
        """Find out before the run that its figures can be written after it."""
        if not self.parameters.output:
            return
        path = Path(self.parameters.output)
        probe = path.with_name(path.name + '.tmp')
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise NodeError(f"cannot write '{path}': {error.strerror}") from error

    def _poll(self) -> None:
        if self._concluded:
            return
        try:
            self._drain()
        except DecodeError as error:
            self._stop_watching(str(error))
            return
        now = time.monotonic()
        if self._conclude_at is None and self._end_reached():
            self._conclude_at = now + _END_GRACE
        newest = self._joiner.newest
        all_through = self._end_reached() and all(
            number > (self._joiner.end or 0) for number in newest.values()
        )
        if all_through or (self._conclude_at is not None and now > self._conclude_at):
            self._conclude()
            self._leave()

    def _drain(self) -> None:
        for topic, key in KEYS.items():
            messages = [message for message, _ in self._taps[topic].take()]
            if not messages:
                continue
            self._joiner.add(key, decode(key, messages))
        for block in self._joiner.take():
            self._progress.add(self._metrics.add(block))

    def _end_reached(self) -> bool:
        end = self._joiner.end
        return end is not None and self._joiner.newest['measurement'] >= end

    def _each_second(self) -> None:
        if self._concluded:
            return
        now = time.monotonic()
        newest = self._joiner.newest
        self._watch.update(newest, now)
        line = self._progress.line(newest['measurement'], self._metrics.phase, now)
        if self._metrics.started:
            print(line, flush=True)
        for topic, tap in self._taps.items():
            count = tap.publisher_count()
            if count > 1:
                self._stop_watching(
                    f'{count} nodes publish {topic}: stop all but one, or use another ROS_DOMAIN_ID'
                )
                return
        self._check_silence(now)

    def _check_silence(self, now: float) -> None:
        publishers = {key: self._taps[topic].publisher_count() for topic, key in KEYS.items()}
        if not self._metrics.started:
            waited = now - self._waiting_since
            if 0.0 < self.parameters.start_timeout < waited:
                blame = self._watch.blame(publishers, now)
                self._stop_watching(f'no run has begun within {waited:.0f} s: {blame}')
        elif self._watch.longest(now).duration > self.parameters.timeout:
            self._stop_watching(f'the run has stopped: {self._watch.blame(publishers, now)}')

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.level[0] < FAULT_LEVEL or status.name == self.get_name() or self._concluded:
                continue
            stamp = round(seconds(message.header.stamp) * 1e9)
            self._metrics.add_fault(stamp, status.name, status.message)
            if self._conclude_at is None:
                self.get_logger().error(f'fault in {status.name}: {status.message}')
                self._conclude_at = time.monotonic() + self.parameters.fault_grace

    def _stop_watching(self, reason: str) -> None:
        """There is nothing left to wait for."""
        self.get_logger().error(reason)
        self._conclude()
        self.finish(1)

    def _leave(self) -> None:
        if self.parameters.exit_at_end:
            self.finish(0 if self._verdict == 'pass' else 1)

    def _conclude(self) -> None:
        """Compute, write and show the figures, once."""
        self._concluded = True
        for block in self._joiner.finish():
            self._progress.add(self._metrics.add(block))
        result = self._metrics.result()
        self._verdict = result['verdict']
        if self.parameters.output:
            try:
                write_metrics(Path(self.parameters.output), result)
            except OSError as error:
                self.fail(f"cannot write '{self.parameters.output}': {error.strerror}")
        if self._metrics.started:
            print(as_text(result), flush=True)


def main() -> None:
    """Entry point of the executable."""
    run_main(MonitorNode, 'monitor', background=True)
