"""The monitor node: progress while a run lasts, its figures and verdict at its end."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from maglev_model.contract.wire import HARDWARE_ID, DecodeError
from maglev_model.parameters import parameter
from maglev_monitor.live.discovery import DiscoveryWatch
from maglev_monitor.live.run_watch import RunWatch, WatchParameters
from maglev_monitor.metrics.result_file import write_metrics
from maglev_monitor.metrics.run_parameters import FAULT_LEVEL, RUN_KEY, run_to_json
from maglev_monitor.report.terminal import as_text
from maglev_node import topics
from maglev_node.node import NodeError
from maglev_node.polling import PolledSubscription
from maglev_node.stamp import nanoseconds
from maglev_node.topics import KEYS, progress_of
from maglev_node.watcher import PROGRESS_TOLD, WatcherNode, WatcherParameters

_POLL_PERIOD = 0.05


@dataclasses.dataclass(frozen=True, kw_only=True)
class MonitorParameters(WatcherParameters, WatchParameters):
    """The monitor's parameters."""

    output: str = parameter('', 'file for metrics.json; empty: none')
    exit_at_end: bool = parameter(
        True, 'leave when the run has ended: 0 when it passed, 1 otherwise'
    )


class MonitorNode(WatcherNode[MonitorParameters]):
    """Takes the samples of all topics in bursts; polls, so that the loop keeps the cores."""

    interface: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(KEYS, 'subscribed: each sample'),
        progress_of('monitor'): PROGRESS_TOLD,
    }

    def __init__(self) -> None:
        super().__init__('monitor', MonitorParameters)
        self._check_output()
        now = time.monotonic()
        domain = self.context.get_domain_id()
        self._discovery = DiscoveryWatch(domain, self.get_namespace(), now)
        self._watch = RunWatch(self.parameters, self._discovery, now)
        self._run_json = run_to_json(self.parameters)
        self._taps: dict[str, PolledSubscription] = {
            topic: self.poll(topic, topics.SAMPLE_TOPICS[topic], raw=True) for topic in KEYS
        }
        self.create_subscription(DiagnosticArray, topics.DIAGNOSTICS, self._on_diagnostics, 100)
        self.create_timer(_POLL_PERIOD, self._poll, clock=self.steady_clock)
        self.create_timer(1.0, self._each_second, clock=self.steady_clock)

    def close(self) -> None:
        """Leave the figures of a run that was broken off."""
        super().close()
        if not self._concluded:
            self._conclude(self._arrived())

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """The state of the run, and its parameters for the bag."""
        values = {**self._watch.progress(), RUN_KEY: self._run_json}
        if self._concluded:
            return DiagnosticStatus.OK, 'the run has ended', values
        if not self._watch.started:
            return DiagnosticStatus.OK, 'waiting for the run to begin', values
        if self._watch.dropped:
            values['dropped_samples'] = self._watch.dropped
            return DiagnosticStatus.WARN, 'samples came too late to be counted', values
        return DiagnosticStatus.OK, 'the run is on', values

    @property
    def _concluded(self) -> bool:
        return self._watch.result is not None

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

    def _arrived(self) -> dict[str, list[bytes]]:
        """Messages that have come, by topic key."""
        return {
            key: [message for message, _ in self._taps[topic].take()] for topic, key in KEYS.items()
        }

    def _poll(self) -> None:
        if self._concluded:
            return
        arrived = self._arrived()
        try:
            self._watch.add(arrived)
        except DecodeError as error:
            self._stop_watching(str(error))
            return
        self.acknowledge(arrived[KEYS[topics.MEASUREMENT]])
        if self._watch.over(time.monotonic()):
            verdict = self._conclude()
            if self.parameters.exit_at_end:
                self.finish(0 if verdict == 'pass' else 1)

    def _each_second(self) -> None:
        if self._concluded:
            return
        now = time.monotonic()
        line = self._watch.line(now)
        if self._watch.started:
            self.show(line)
        self._look_around(now)
        publishers = {topic: tap.publisher_count() for topic, tap in self._taps.items()}
        for topic, count in publishers.items():
            if count > 1:
                self._stop_watching(
                    f'{count} nodes publish {self._taps[topic].topic}: stop all but one,'
                    ' or use another namespace or ROS_DOMAIN_ID'
                )
                return
        reason = self._watch.given_up({KEYS[topic]: n for topic, n in publishers.items()}, now)
        if reason:
            self._stop_watching(reason)

    def _look_around(self, now: float) -> None:
        """Say early when discovery does not work, which nothing else would tell."""
        here, known = self.get_namespace(), self.get_node_names_and_namespaces()
        others = {name for name, where in known if where == here} - self.in_process
        self._discovery.update({name for name in others if not name.startswith('_')})  # ros2cli's
        warning = self._discovery.warning(now)
        if warning:
            self.get_logger().warning(warning)

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            ours = status.hardware_id == HARDWARE_ID and status.name != self.get_name()
            if not ours or status.level[0] < FAULT_LEVEL or self._concluded:
                continue
            stamp = nanoseconds(message.header.stamp)
            if self._watch.add_fault(stamp, status.name, status.message, time.monotonic()):
                self.get_logger().error(f'fault in {status.name}: {status.message}')

    def _stop_watching(self, reason: str) -> None:
        """There is nothing left to wait for."""
        self.get_logger().error(reason)
        self._conclude()
        self.finish(1)

    def _conclude(self, last: Mapping[str, list[bytes]] | None = None) -> str:
        """Write and show the figures; the verdict."""
        result = self._watch.conclude(last)
        if self.parameters.output:
            try:
                write_metrics(Path(self.parameters.output), result)
            except OSError as error:
                self.fail(f"cannot write '{self.parameters.output}': {error.strerror}")
        if self._watch.started:
            self.show(as_text(result))
        return str(result['verdict'])
