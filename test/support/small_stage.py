"""A managed node with parameters, services and topics of each kind, which does nothing else."""

from __future__ import annotations

import dataclasses
from typing import Any

from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import SetBool

from maglev_model.parameters import group, parameter, specs
from maglev_msgs.msg import Measurement
from maglev_node.executable import run_nodes
from maglev_node.managed_node import ManagedNode, ManagedParameters
from maglev_node.topics import MEASUREMENT, sample_qos


@dataclasses.dataclass(frozen=True, kw_only=True)
class Limits:
    """A group."""

    current: float = parameter(7.0, 'largest current', unit='A', within=(0.1, 50.0))
    weights: tuple[float, ...] = parameter((1.0, 2.5), 'weights of two axes')


@dataclasses.dataclass(frozen=True, kw_only=True)
class SmallParameters(ManagedParameters):
    """Of each type one."""

    name: str = parameter('a name', 'what it is called')
    steps: int = parameter(3, 'how many steps', within=(1, 10))
    limits: Limits = group(Limits)


class SmallStage(ManagedNode[SmallParameters]):
    """Measures at 100 Hz what never changes, and says once what it is, for whoever comes."""

    changeable = specs(SmallParameters)

    def __init__(self) -> None:
        super().__init__('small', SmallParameters)
        self.create_service(SetBool, '~/enable', self._enable)
        self._measurement = self.create_publisher(Measurement, MEASUREMENT, sample_qos())
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._kept = self.create_publisher(String, 'kept', kept)
        self._kept.publish(String(data='said once'))
        self.create_subscription(String, 'heard', self._hear, 10)
        self._sequence = 0
        self.create_timer(0.01, self._measure, clock=self.steady_clock)

    def _measure(self) -> None:
        message = Measurement(sequence=self._sequence, x=0.018, lockstep=True)
        message.header.frame_id = 'stage'
        message.gap[:] = 0.03
        self._measurement.publish(message)
        self._sequence += 1

    def _enable(self, request: Any, response: Any) -> Any:
        response.success, response.message = bool(request.data), 'as it was asked'
        return response

    def _hear(self, message: String) -> None:
        self.get_logger().info(f'heard: {message.data}')


if __name__ == '__main__':
    run_nodes('small_stage', SmallStage)
