"""The recorder node: every message of every topic of a run, raw, into a bag."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from ament_index_python.packages import get_package_share_directory
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.msg import Log, ParameterEvent
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)

from maglev_model.parameters import parameter
from maglev_model.programs.revision import revision
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.log_time import LogTimes
from maglev_monitor.bag.writer import BagWriter
from maglev_node.node import NodeError
from maglev_node.polling import PolledSubscription
from maglev_node.topics import DIAGNOSTICS, MEASUREMENT, SAMPLE_TOPICS, progress_of
from maglev_node.watcher import PROGRESS_TOLD, WatcherNode, WatcherParameters

TOPICS: dict[str, type] = {
    **SAMPLE_TOPICS,
    DIAGNOSTICS: DiagnosticArray,
    '/parameter_events': ParameterEvent,
    '/rosout': Log,
}
"""What is recorded, with the message types."""

_QOS = {
    # also what was logged before the recorder came
    '/rosout': QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
}

_POLL_PERIOD = 0.05


@dataclasses.dataclass(frozen=True, kw_only=True)
class RecorderParameters(WatcherParameters):
    """The recorder's parameters."""

    output: str = parameter('bag', "the bag's folder, which must not exist yet")
    compress: bool = parameter(True, 'compress the chunks of the bag with zstd')
    command: str = parameter('', 'by what the run was started, for the bag')
    flush_period: float = parameter(
        1.0, 'what a kill can cost at most', unit='s', within=(0.05, 60.0)
    )


class RecorderNode(WatcherNode[RecorderParameters]):
    """Takes the raw messages of all topics in bursts and writes them to a bag."""

    interface: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(TOPICS, 'subscribed: each message'),
        progress_of('recorder'): PROGRESS_TOLD,
    }

    def __init__(self) -> None:
        super().__init__('recorder', RecorderParameters)
        self._writer = BagWriter(
            Path(self.parameters.output),
            message_folder,
            compress=self.parameters.compress,
            custom={'software': revision(), 'command': self.parameters.command},
        )
        self._open()
        self._taps: dict[str, PolledSubscription] = {
            topic: self.poll(topic, message_type, _QOS.get(topic), raw=True)
            for topic, message_type in TOPICS.items()
        }
        self._log_times = LogTimes()
        self._failed = False
        self._flushed = time.monotonic()
        self.create_timer(_POLL_PERIOD, self._poll, clock=self.steady_clock)
        self.get_logger().info(f"recording to '{self.parameters.output}'")

    def close(self) -> None:
        """Take what still waits and finish the bag."""
        super().close()
        self._poll()
        self._log_times.end()
        self._poll()
        try:
            self._writer.close()
        except BagError as error:
            self._failed = True
            self.get_logger().error(str(error))
        if self._failed:
            self.exit_code = 1
        total = sum(self._writer.counts.values())
        self.get_logger().info(f"{total} messages in '{self.parameters.output}'")

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Messages recorded by topic."""
        return DiagnosticStatus.OK, 'recording', self._writer.counts

    def _open(self) -> None:
        try:
            self._writer.open()
            for message_type in TOPICS.values():
                self._writer.know(type_name(message_type))
        except BagError as error:
            raise NodeError(str(error)) from error

    def _poll(self) -> None:
        if self._failed:
            return
        try:
            measured: list[bytes] = []
            for topic, tap in self._taps.items():
                taken = list(tap.take())
                if topic == MEASUREMENT:
                    measured = [message for message, _ in taken]
                messages = self._log_times.of(type_name(TOPICS[topic]), taken)
                if not messages:
                    continue
                if tap.topic not in self._writer.counts:
                    self._add_topic(tap.topic, TOPICS[topic])
                self._writer.write(tap.topic, messages)
            self.acknowledge(measured)
            now = time.monotonic()
            if now - self._flushed > self.parameters.flush_period:
                self._flushed = now
                self._writer.flush()
        except BagError as error:
            self._failed = True
            self.fail(str(error))

    def _add_topic(self, topic: str, message_type: type) -> None:
        """Add a topic with the QoS of those who publish it."""
        offered = [info.qos_profile for info in self.get_publishers_info_by_topic(topic)]
        unique = list(dict.fromkeys(bag_qos(profile) for profile in offered))
        self._writer.add_topic(topic, type_name(message_type), unique)


def type_name(message_type: type) -> str:
    """The name of a message class as bags write it, ``maglev_msgs/msg/Currents``."""
    return f'{message_type.__module__.split(".")[0]}/msg/{message_type.__name__}'


def message_folder(package: str) -> Path:
    """The folder with the .msg files of an installed package. Raises LookupError."""
    return Path(get_package_share_directory(package)) / 'msg'


def bag_qos(profile: QoSProfile) -> Qos:
    """A QoS profile as bags write it."""
    return Qos(
        QosHistory(int(profile.history)),
        profile.depth,
        QosReliability(int(profile.reliability)),
        QosDurability(int(profile.durability)),
        _bag_time(profile.deadline.nanoseconds),
        _bag_time(profile.lifespan.nanoseconds),
        QosLiveliness(int(profile.liveliness)),
        _bag_time(profile.liveliness_lease_duration.nanoseconds),
        bool(profile.avoid_ros_namespace_conventions),
    )


def _bag_time(nanoseconds: int) -> QosTime:
    return QosTime(*divmod(nanoseconds, 1_000_000_000))
