"""The controller's node: answers every measurement with currents."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import SetBool, Trigger

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Mode, Supervisor
from maglev_model.parameters import build, parameter, specs, values
from maglev_model.phases import Phase
from maglev_msgs.msg import ControllerState, Currents, Measurement, Reference
from maglev_node.graph_guard import GraphGuard
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.polling import Queues
from maglev_node.process import main as run_main
from maglev_node.stamp import copy_stamp, stamp_now
from maglev_node.topics import (
    CONTROLLER_STATE,
    CURRENTS,
    MEASUREMENT,
    REFERENCE,
    reference_qos,
    sample_qos,
)

_REFERENCE_PERIOD = 2e-3  # between two looks at what references have arrived [s]
_HAND_PERIOD = 2e-4  # between two looks at the queues during a redesign [s]
_SILENCE = 0.5  # without a sample for this long the stage is taken for stopped [s]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ControllerNodeParameters(SourceParameters, ControllerParameters):
    """The regulator and how its node runs it."""

    enabled: bool = parameter(True, 'follow the reference from the start; false: after ~/enable')
    reference_timeout: float = parameter(
        2.0,
        'lockstep: longest wait for a reference in flight, wall clock; then it lands',
        unit='s',
        within=(0.1, 600.0),
    )
    measurement_timeout: float = parameter(
        0.02,
        'a longer gap between measurements, in stage time, is a fault in flight',
        unit='s',
        within=(0.001, 1.0),
    )


class ControllerNode(MaglevNode[ControllerNodeParameters]):
    """Currents for each measurement, the controller's state for analysis, and its services.

    In lockstep the answer waits for the reference of its sample, without limit for the very first,
    so that a run begins when everything is there and is the same every time.
    """

    def __init__(self) -> None:
        super().__init__('controller', ControllerNodeParameters)
        self.supervisor = Supervisor(self._law(self.parameters), enabled=self.parameters.enabled)
        self._lockstep = self.parameters.mode == 'lockstep'
        self._longest_gap = self.parameters.measurement_timeout / self.parameters.sample_time
        self._sequence = -1
        self._pending: Measurement | None = None
        self._pending_since = self._answered = 0.0
        self._reference_lost = self._reference_over = False
        self._logged = (self.supervisor.mode, self.supervisor.reason)
        self._currents, self._state = Currents(), ControllerState()
        self._currents.header.frame_id = self._state.header.frame_id = 'stage'
        GraphGuard(self).claim(CURRENTS, 'controller')
        self._currents_publisher = self.create_publisher(Currents, CURRENTS, sample_qos())
        self._state_publisher = self.create_publisher(
            ControllerState, CONTROLLER_STATE, sample_qos()
        )
        self._queues = Queues(self)
        self._references = self._queues.subscribe(REFERENCE, Reference, reference_qos())
        self._measurements = self.create_subscription(
            Measurement, MEASUREMENT, self._on_measurement, sample_qos()
        )
        self.create_service(SetBool, '~/enable', self._on_enable)
        self.create_service(Trigger, '~/emergency_stop', self._on_emergency_stop)
        self.create_service(Trigger, '~/reset', self._on_reset)
        self.create_timer(_REFERENCE_PERIOD, self._take_references, clock=self.steady_clock)
        self.create_timer(0.05, self._watch, clock=self.steady_clock)
        self.take_realtime_priority()
        for line in self.supervisor.regulator.describe_loops():
            self.get_logger().info(line)
        # The first line a process logs takes 20 ms, so it must not be one that is logged in flight.
        self.get_logger().info(f'{self.parameters.mode}, waiting for {MEASUREMENT}')

    def _take_references(self) -> None:
        """Take what has arrived ahead of time, in bursts: being woken for each slows the loop."""
        references = self.supervisor.references
        for message, _ in self._references.take():
            if message.sequence <= references.newest and self.supervisor.flying:
                continue  # of a second reference, which will find the first and leave
            references.store(
                message.sequence,
                message.phase,
                message.segment,
                message.position,
                message.velocity,
                message.acceleration,
            )
            self._reference_lost = False
            self._reference_over = message.phase == Phase.END
        self._answer_pending()

    def _on_measurement(self, message: Measurement) -> None:
        sequence = message.sequence
        if self._sequence < 0 and not self._watched():
            return
        if sequence == self._sequence:  # repeated: the answer was not heard
            self._currents_publisher.publish(self._currents)
            return
        if sequence < self._sequence:
            if self.supervisor.flying and time.monotonic() - self._answered < _SILENCE:
                return  # of a second stage, which will find the first and leave
            self.get_logger().warning('the stage began anew')
            self.supervisor.restart()
            self._sequence, self._pending = -1, None
            self._reference_lost = self._reference_over = False
        elif sequence - self._sequence > self._longest_gap and self.supervisor.flying:
            self.supervisor.cut(f'{sequence - self._sequence - 1} measurements are missing')
        if self.supervisor.references.newest < sequence:
            self._take_references()
            if self._sequence == sequence:  # it was pending, and is answered
                return
        if self._lockstep and self._awaits_reference(sequence):
            if self._pending is None or self._pending.sequence != sequence:
                self._pending, self._pending_since = message, time.monotonic()
            return
        self._answer(message)

    def _watched(self) -> bool:
        """Whether the stage, and all who shall see every sample, are there."""
        watchers = self.parameters.watchers
        stage_and_reference = 2 if watchers and not self._lockstep else 1
        return bool(
            self._currents_publisher.get_subscription_count() >= watchers + stage_and_reference
            and self._state_publisher.get_subscription_count() >= watchers
        )

    def _awaits_reference(self, sequence: int) -> bool:
        supervisor = self.supervisor
        if self._reference_lost or supervisor.mode not in (Mode.WAITING, Mode.REGULATING):
            return False
        references = supervisor.references
        if self._reference_over and sequence > references.newest:
            return False
        return references.find(sequence) < 0

    def _answer(self, message: Measurement) -> None:
        self._pending = None
        self._answered = time.monotonic()
        supervisor = self.supervisor
        sequence = self._sequence = message.sequence
        row = supervisor.references.find(sequence)
        if row < 0 and self._reference_over and supervisor.references.newest < sequence:
            row = supervisor.references.find(supervisor.references.newest)
        supervisor.step(row, message.gap, message.x, message.z)
        self._publish_currents(sequence)
        self._publish_state(sequence)
        if (supervisor.mode, supervisor.reason) != self._logged:
            self._log_change()

    def _publish_currents(self, sequence: int) -> None:
        message = self._currents
        stamp_now(message.header.stamp)
        message.sequence = sequence
        message.direct_current = self.supervisor.direct_current
        message.quadrature_current = self.supervisor.quadrature_current
        self._currents_publisher.publish(message)

    def _publish_state(self, sequence: int) -> None:
        message, regulator = self._state, self.supervisor.regulator
        copy_stamp(self._currents.header.stamp, message.header.stamp)
        message.sequence = sequence
        message.mode = int(self.supervisor.mode)
        message.saturated = self.supervisor.saturated
        message.position = regulator.position
        message.error = regulator.error
        message.error_rate = regulator.error_rate
        message.virtual_input = regulator.virtual_input
        message.internal_model = regulator.internal_model
        self._state_publisher.publish(message)

    def _log_change(self) -> None:
        mode, reason = self._logged = (self.supervisor.mode, self.supervisor.reason)
        text = f'{mode.name.lower()} at sample {self._sequence}' + (f': {reason}' if reason else '')
        if mode in (Mode.FAULT, Mode.LANDING):
            self.get_logger().error(text)
        else:
            self.get_logger().info(text)

    def _watch(self) -> None:
        """In lockstep, give a lost reference up: the answer that waits for it starts a landing."""
        if self._pending is None or self.supervisor.references.newest < 0:
            return
        if time.monotonic() - self._pending_since > self.parameters.reference_timeout:
            self._reference_lost = True
            self._answer(self._pending)

    def may_stop(self) -> bool:
        """Land before ending, unless the stage is silent."""
        supervisor = self.supervisor
        if supervisor.flying and supervisor.mode != Mode.LANDING:
            supervisor.disable()
            self._answer_pending()
        silent = time.monotonic() - self._answered > _SILENCE
        return not supervisor.flying or silent

    def _on_enable(self, request: Any, response: Any) -> Any:
        action = self.supervisor.enable if request.data else self.supervisor.disable
        response.success, response.message = action()
        self._answer_pending()
        return response

    def _on_emergency_stop(self, _request: Any, response: Any) -> Any:
        self.supervisor.cut('emergency stop')
        self._publish_currents(self._sequence)
        self._answer_pending()
        response.success, response.message = True, 'currents cut; call ~/reset, then ~/enable'
        return response

    def _on_reset(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self.supervisor.reset_fault()
        return response

    def _answer_pending(self) -> None:
        if self._pending is not None and not self._awaits_reference(self._pending.sequence):
            self._answer(self._pending)

    def on_parameters(self, parameters: ControllerNodeParameters) -> None:
        """Redesign in another process, serving the loop, and change over between two samples."""
        law = self._law(parameters)
        if law != self.supervisor.parameters:
            design = self.supervisor.redesign(law)
            while not design.done:
                self._serve_by_hand()
                time.sleep(_HAND_PERIOD)
            self.supervisor.adopt(*design.result())
        self._longest_gap = parameters.measurement_timeout / parameters.sample_time

    @staticmethod
    def _law(parameters: ControllerNodeParameters) -> ControllerParameters:
        """The node's parameters without those that are only the node's."""
        table = specs(ControllerParameters)
        return build(
            ControllerParameters, {k: v for k, v in values(parameters).items() if k in table}
        )

    def _serve_by_hand(self) -> None:
        """What the executor does for the loop, while it waits for a callback of ours."""
        self._take_references()
        with self._measurements.handle:
            while taken := self._measurements.handle.take_message(Measurement, False):
                self._on_measurement(taken[0])

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR in a fault and in a landing nobody asked for."""
        supervisor = self.supervisor
        facts = {'mode': supervisor.mode.name, 'sequence': self._sequence}
        failed = supervisor.mode in (Mode.FAULT, Mode.LANDING) or 'landed' in supervisor.reason
        if failed and 'disabled' not in supervisor.reason:
            return DiagnosticStatus.ERROR, f'{supervisor.mode.name}: {supervisor.reason}', facts
        return DiagnosticStatus.OK, supervisor.reason or supervisor.mode.name.lower(), facts

    def close(self) -> None:
        """The last word is zero current."""
        self.supervisor.cut('shut down')
        if self._sequence >= 0:
            self._publish_currents(self._sequence)
        self._queues.destroy()


def main() -> None:
    """Entry point of the executable ``controller``."""
    run_main(ControllerNode, 'controller')
