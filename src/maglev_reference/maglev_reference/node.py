"""The reference node: publishes where the platen shall be, some samples ahead of the stage."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from maglev_model.parameters import parameter
from maglev_model.phases import Phase
from maglev_model.platen import outputs_of_gaps
from maglev_msgs.msg import Currents, Measurement, Reference
from maglev_node.graph_guard import GraphGuard
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.polling import Queues
from maglev_node.process import main as run_main
from maglev_node.stamp import stamp_now
from maglev_node.topics import CURRENTS, MEASUREMENT, REFERENCE, reference_qos, sample_qos
from maglev_reference.accuracy import summary, warnings
from maglev_reference.check import UnreachableError
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.run import ReferenceRun
from maglev_reference.timeline import Timeline

_REMINDER = 5.0  # between two lines about what is waited for [s]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReferenceNodeParameters(SourceParameters, ReferenceParameters):
    """The reference and how it is published."""

    autostart: bool = parameter(True, 'start by itself; false: by ~/lift_off', read_only=True)
    exit_at_end: bool = parameter(False, 'end the process when the run is over', read_only=True)
    lead: int = parameter(
        64,
        'how far the reference is published ahead',
        unit='samples',
        within=(1, 200),
        read_only=True,
    )
    poll_period: float = parameter(
        0.004,
        'how often the newest measurement is looked at, wall clock',
        unit='s',
        within=(0.0005, 0.1),
        read_only=True,
    )
    timeout: float = parameter(
        1.0,
        'longest time without a measurement while running, wall clock',
        unit='s',
        within=(0.05, 600.0),
        read_only=True,
    )


class ReferenceNode(MaglevNode[ReferenceNodeParameters]):
    """Publishes ``/reference`` up to ``lead`` samples ahead of the newest measurement.

    It looks at the newest measurement on a short timer instead of being woken by each one. The
    first measurement seen once all subscribers are there tells where the platen rests and becomes
    sample 0 of the timeline.
    """

    def __init__(self) -> None:
        super().__init__('reference', ReferenceNodeParameters)
        Timeline(self.parameters)  # refuses what cannot be followed before anything is waited for
        for line in warnings(self.parameters):
            self.get_logger().warning(line)
        for line in summary(self.parameters):
            self.get_logger().info(line)
        self._graph = GraphGuard(self)
        self._graph.claim(REFERENCE, 'reference')
        self._run = ReferenceRun(self.parameters, self.parameters.lead, self.parameters.autostart)
        self._expected = self.parameters.watchers + 1  # and the controller
        self._seen = self._reminded = time.monotonic()
        self._message = Reference()
        self._message.header.frame_id = 'stage'
        self._publisher = self.create_publisher(Reference, REFERENCE, reference_qos())
        self._queues = Queues(self)
        self._measurements = self._queues.subscribe(MEASUREMENT, Measurement, sample_qos(1))
        # In real time nobody waits for the controller but us; in lockstep it waits for us.
        self._answers = None
        if self.parameters.mode == 'realtime':
            self._answers = self._queues.subscribe(CURRENTS, Currents, sample_qos(1))
        self.create_service(Trigger, '~/lift_off', self._lift_off)
        self.create_service(Trigger, '~/land', self._land)
        self.create_timer(self.parameters.poll_period, self._poll, clock=self.steady_clock)
        self.take_realtime_priority()

    def _poll(self) -> None:
        measurement = None
        for message, _ in self._measurements.take(1):
            if self._run.observe(int(message.sequence)):
                measurement, self._seen = message, time.monotonic()
        if not self._run.started:
            self._wait(measurement)
        elif measurement is None:
            self._watch()
        if self._run.started:
            self._publish()
            self._follow_phase()

    def _wait(self, measurement: Measurement | None) -> None:
        answered = self._answers is None or any(self._answers.take(1))
        if measurement is not None and answered and self._listeners() >= self._expected:
            self._start(measurement)
        elif time.monotonic() - self._reminded > _REMINDER:
            self._reminded = time.monotonic()
            self.get_logger().info(self._waiting_for())

    def _listeners(self) -> int:
        return int(self._publisher.get_subscription_count())

    def _waiting_for(self) -> str:
        there = self._listeners()
        if there < self._expected:
            return f'waiting for {self._expected} subscribers of {REFERENCE}, {there} are there'
        if self._measurements.publisher_count() == 0:
            return f'waiting for a stage on {MEASUREMENT}'
        return f'waiting for the controller to answer on {CURRENTS}'

    def _start(self, measurement: Measurement) -> None:
        if not self._graph.alone():
            return
        radius = self.parameters.machine.radius
        rest = outputs_of_gaps(np.array(measurement.gap), measurement.x, measurement.z, radius)
        try:
            self._run.start(rest)
        except UnreachableError as error:
            self._refuse(str(error))
        else:
            start = 'starting' if self._run.autostart else 'resting until ~/lift_off'
            self.get_logger().info(f'{start} at sample {self._run.newest}')

    def _refuse(self, message: str) -> None:
        """Fail; but while another reference may yet be discovered, it may be flying the platen."""
        if not self._graph.on_probation():
            self.fail(message)

    def _publish(self) -> None:
        due = self._run.due()
        if due is None:
            return
        first, block = due
        message = self._message
        stamp_now(message.header.stamp)
        for row in range(len(block.phase)):
            message.sequence = first + row
            message.phase = int(block.phase[row])
            message.segment = int(block.segment[row])
            message.position = block.position[row]
            message.velocity = block.velocity[row]
            message.acceleration = block.acceleration[row]
            message.target = block.target[row]
            self._publisher.publish(message)

    def _follow_phase(self) -> None:
        """Say what the stage is asked to do now, and end where that is wanted."""
        if self._run.enter_phase():
            self.get_logger().info(f'{self._run.phase.name} at sample {self._run.newest}')
        if self.parameters.exit_at_end and self._run.over:
            self.finish(0)

    def _watch(self) -> None:
        silent = time.monotonic() - self._seen
        if silent < self.parameters.timeout:
            return
        if self._run.grounded:  # another stage may follow
            if self._run.phase == Phase.END and self.parameters.exit_at_end:
                self.finish(0)
            return
        who = 'the stage, or the controller it waits for, has stopped'
        if self._measurements.publisher_count() == 0:
            who = 'the stage is gone'
        self.fail(f'no measurement for {silent:.1f} s after sample {self._run.newest}: {who}')

    def _lift_off(self, _request: Any, response: Any) -> Any:
        if not self._run.started:
            response.success, response.message = False, self._waiting_for()
        else:
            response.success = self._run.lift_off()
            response.message = 'lifting off' if response.success else 'the reference is running'
        return response

    def _land(self, _request: Any, response: Any) -> Any:
        if not self._run.started:
            response.success, response.message = False, self._waiting_for()
        else:
            response.success = self._run.land()
            response.message = 'landing' if response.success else 'landing already, or landed'
        return response

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """WARN while something is waited for."""
        if not self._run.started:
            return DiagnosticStatus.WARN, self._waiting_for(), {}
        facts = {
            'phase': self._run.phase.name,
            'sequence': self._run.newest,
            'ahead': self._run.ahead,
        }
        return DiagnosticStatus.OK, 'running', facts

    def close(self) -> None:
        """The queue is given up; the controller lands by itself when the reference ends."""
        self._queues.destroy()


def main() -> None:
    """Entry point of the executable ``reference``."""
    run_main(ReferenceNode, 'reference')
