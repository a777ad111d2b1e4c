"""The node that every stage is: one class over different back ends, lockstep or real time."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from maglev_msgs.msg import Currents, Measurement
from maglev_node.node import MaglevNode, NodeError, SourceParameters
from maglev_node.parameters import ParameterError, parameter
from maglev_node.stage import Stage, StageError
from maglev_node.stamp import stamp_now
from maglev_node.topics import CURRENTS, MEASUREMENT, sample_qos

_REPEAT_PERIOD = 0.02


@dataclasses.dataclass(frozen=True, kw_only=True)
class StageNodeParameters(SourceParameters):
    """What every stage's node takes."""

    mode: str = parameter(
        'lockstep',
        choices=('lockstep', 'realtime'),
        description='lockstep: each sample waits for its currents; realtime: 1 kHz by the clock',
        read_only=True,
    )
    answer_timeout: float = parameter(
        5.0,
        unit='s',
        lower=0.1,
        upper=600.0,
        description='lockstep: longest wait for the currents of a sample, wall clock',
    )
    watchdog: float = parameter(
        0.02,
        unit='s',
        lower=0.002,
        upper=1.0,
        description='realtime: without fresh currents for this long they are cut',
    )
    realtime_priority: int = parameter(
        40,
        lower=0,
        upper=98,
        description='realtime: SCHED_FIFO priority of the process, where permitted; 0: none',
        read_only=True,
    )
    overrun_limit: float = parameter(
        0.5,
        unit='s',
        lower=0.005,
        upper=10.0,
        description='realtime: the stage gives up when it runs this late',
    )


class StageNode(MaglevNode[Any]):
    """Publishes the encoders of a :class:`Stage` and writes the currents that answer them.

    Lockstep: sample 0 is repeated until a controller answers it; from then on each sample waits
    for the currents with its sequence number. Real time: a sample every ``sample_time``, with the
    newest currents, hence one sample of delay. A fault is latched: no current until ``~/reset``.
    """

    def __init__(
        self,
        name: str,
        parameter_table: type[StageNodeParameters],
        make_stage: Callable[[Any], Stage],
    ) -> None:
        super().__init__(name, parameter_table)
        self.sample_time = float(self.parameters.sample_time)
        try:
            self.stage = make_stage(self.parameters)
        except StageError as error:
            raise NodeError(str(error)) from error
        self.claim(MEASUREMENT, 'stage')
        self.fault: str | None = None
        self.late_samples = 0
        self._answered = False
        self._zero = np.zeros(4)
        self._direct = np.zeros(4)
        self._quadrature = np.zeros(4)
        self._currents_sequence = -1
        self.measurement = Measurement()
        self.measurement.header.frame_id = 'stage'
        self._publisher = self.create_publisher(Measurement, MEASUREMENT, sample_qos())
        self.sequence = 0
        self._sample_wall_time = time.monotonic()
        self._sample = self.stage.read()
        for service, action in (
            ('~/emergency_stop', self._emergency_stop),
            ('~/reset', self._reset),
        ):
            self.create_service(Trigger, service, action)
        self._lockstep = self.parameters.mode == 'lockstep'
        if self._lockstep:
            self._subscription = self.create_subscription(
                Currents, CURRENTS, self._on_answer, sample_qos()
            )
            self.create_timer(_REPEAT_PERIOD, self._watch_lockstep, clock=self.steady_clock)
        else:
            self._subscription = self.create_subscription(
                Currents, CURRENTS, self._on_currents, sample_qos()
            )
            self._first_tick = time.monotonic()
            self.create_timer(self.sample_time, self._on_tick, clock=self.steady_clock)
            self.take_realtime_priority(self.parameters.realtime_priority)
        self.get_logger().info(f'{self.parameters.mode}, waiting for a controller on {CURRENTS}')

    # -- lockstep ----------------------------------------------------------------------------------

    def _on_answer(self, message: Currents) -> None:
        if message.sequence != self.sequence or not (self._answered or self.watched()):
            return
        self._answered = True
        self._apply(message.direct_current, message.quadrature_current)
        self._advance()

    def _watch_lockstep(self) -> None:
        waited = time.monotonic() - self._sample_wall_time
        if not self._answered:
            self._publish()
        elif waited > self.parameters.answer_timeout:
            who = (
                'the controller, or the reference it waits for, has stopped'
                if self._subscription.get_publisher_count()
                else f'no controller publishes {CURRENTS} any more'
            )
            self.fail(f'no currents for sample {self.sequence} within {waited:.1f} s: {who}')

    # -- real time ---------------------------------------------------------------------------------

    def _on_currents(self, message: Currents) -> None:
        self._currents_sequence = message.sequence
        self._direct = message.direct_current
        self._quadrature = message.quadrature_current
        self._answered = True

    def _on_tick(self) -> None:
        due = int((time.monotonic() - self._first_tick) / self.sample_time)
        behind = (due - self.sequence) * self.sample_time
        if behind > self.parameters.overrun_limit:
            self.fail(
                f'{behind:.2f} s behind the clock at sample {self.sequence}: this machine is too'
                ' slow or too busy for real time; free a core, or use mode lockstep'
            )
            return
        for _ in range(max(1, due - self.sequence)):
            self._tick()

    def _tick(self) -> None:
        if self._answered:
            age = self.sequence - self._currents_sequence
            if age > 0:
                self.late_samples += 1
            if age * self.sample_time > self.parameters.watchdog and self.fault is None:
                self._latch(f'no fresh currents for {age * self.sample_time * 1e3:.0f} ms')
        self._advance()
        self._apply(self._direct, self._quadrature)

    # -- both --------------------------------------------------------------------------------------

    def _advance(self) -> None:
        try:
            self._sample = self.stage.read()
        except StageError as error:
            self.fail(str(error))
            return
        self.sequence += 1
        self._sample_wall_time = time.monotonic()
        self._publish()

    def _publish(self) -> None:
        message = self.measurement
        stamp_now(message.header.stamp)
        message.sequence = self.sequence
        message.gap = self._sample.gap
        message.x = self._sample.x
        message.z = self._sample.z
        message.late_samples = self.late_samples
        self._publisher.publish(message)
        self.publish_more()

    def watched(self) -> bool:
        """Whether all who shall see every sample are there."""
        listeners = self.parameters.watchers + 1  # and the controller
        return bool(self._publisher.get_subscription_count() >= listeners)

    def publish_more(self) -> None:
        """What a stage publishes beside each measurement."""

    def _apply(self, direct_current: Any, quadrature_current: Any) -> None:
        if self.fault is None:
            try:
                self.stage.write(direct_current, quadrature_current)
                return
            except (ValueError, StageError) as error:
                self._latch(str(error))
        self.stage.write(self._zero, self._zero)

    def _latch(self, reason: str) -> None:
        self.fault = reason
        self.get_logger().error(f'currents cut at sample {self.sequence}: {reason}; call ~/reset')

    def _emergency_stop(self, _request: Any, response: Any) -> Any:
        if self.fault is None:
            self._latch('emergency stop')
        response.success = True
        return response

    def _reset(self, _request: Any, response: Any) -> Any:
        response.success = self.fault is not None
        response.message = f'cleared: {self.fault}' if self.fault else 'there is no fault'
        self.fault = None
        return response

    def on_parameters(self, parameters: Any) -> None:
        """Only the time-outs change while running."""
        changeable = {
            'answer_timeout': parameters.answer_timeout,
            'watchdog': parameters.watchdog,
            'overrun_limit': parameters.overrun_limit,
        }
        if parameters != dataclasses.replace(self.parameters, **changeable):
            raise ParameterError(
                f'only {", ".join(changeable)} can change while the stage runs; restart it instead'
            )

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR when a fault is latched, WARN when samples came late."""
        facts = {
            'mode': self.parameters.mode,
            'sequence': self.sequence,
            'late_samples': self.late_samples,
        }
        if self.fault is not None:
            return DiagnosticStatus.ERROR, f'currents cut: {self.fault}', facts
        if not self._answered:
            return DiagnosticStatus.WARN, 'waiting for a controller', facts
        if self.late_samples:
            return DiagnosticStatus.WARN, 'some currents came late', facts
        return DiagnosticStatus.OK, 'running', facts

    def close(self) -> None:
        """No current flows, and the stage is released."""
        self.stage.close()
