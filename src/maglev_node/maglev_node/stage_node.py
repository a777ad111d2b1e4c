"""The node that every stage is: one class over different back ends, lockstep or real time."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from maglev_model.parameters import ParameterError, parameter
from maglev_model.stage import EncoderSample, Stage, StageError
from maglev_msgs.msg import Currents, Measurement
from maglev_node.managed_node import ManagedNode, ManagedParameters
from maglev_node.node import NodeError
from maglev_node.polling import PolledSubscription, Queues
from maglev_node.stamp import stamp_now
from maglev_node.topics import CURRENTS, MEASUREMENT, sample_qos

_REPEAT_PERIOD = 0.02
_TIMEOUTS = ('answer_timeout', 'watchdog', 'overrun_limit')


@dataclasses.dataclass(frozen=True, kw_only=True)
class StageNodeParameters(ManagedParameters):
    """What every stage's node takes."""

    answer_timeout: float = parameter(
        5.0,
        unit='s',
        lower=0.1,
        upper=600.0,
        description='lockstep: longest wait for the currents of a sample, wall clock',
    )
    first_sequence: int = parameter(
        0,
        lower=0,
        upper=2**62,
        description='number of the first sample, to go on where another stage has ended',
        read_only=True,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class ClockedStageParameters(StageNodeParameters):
    """What the node of a stage takes that has no clock of its own."""

    watchdog: float = parameter(
        0.05,
        unit='s',
        lower=0.002,
        upper=1.0,
        description='realtime: without fresh currents for this long they are cut',
    )
    overrun_limit: float = parameter(
        0.5,
        unit='s',
        lower=0.005,
        upper=10.0,
        description='realtime: the stage gives up when it runs this late',
    )


class StageNode(ManagedNode[Any]):
    """Publishes the encoders of a :class:`Stage` and writes the currents that answer them.

    Lockstep: the first sample is repeated until a controller answers it; from then on each sample
    waits for the currents with its sequence number. Real time: a sample every ``sample_time``, with
    the newest currents, hence one sample of delay. A fault is latched: no current until
    ``~/reset``. Then, as after activation, currents are followed only once they have been zero: a
    controller that went on flying meanwhile would throw the platen off its stop.
    Configured, it holds its stage and its place on the graph; active, it samples.
    """

    def __init__(
        self,
        name: str,
        parameter_table: type[StageNodeParameters],
        make_stage: Callable[[Any], Stage],
    ) -> None:
        super().__init__(name, parameter_table)
        self.sample_time = float(self.parameters.sample_time)
        self._make_stage = make_stage
        self.stage: Any = None
        self.fault: str | None = None
        self.late_samples = 0
        self._answered = False
        self._armed = False
        self._zero = np.zeros(4)
        self._direct = np.zeros(4)
        self._quadrature = np.zeros(4)
        self._currents_sequence = -1
        self.measurement = Measurement()
        self.measurement.header.frame_id = 'stage'
        self.sequence = -1
        self._sample_wall_time = self._first_tick = time.monotonic()
        self._first_sequence = 0  # of this activation
        self._sample: EncoderSample | None = None
        self._publisher: Any = None
        self._subscription: Any = None  # lockstep
        self._queues: Queues | None = None  # real time
        self._newest_currents: PolledSubscription | None = None
        self._timer: Any = None
        self._lockstep = self.parameters.mode == 'lockstep'
        for service, action in (
            ('~/emergency_stop', self._emergency_stop),
            ('~/reset', self._reset),
        ):
            self.create_service(Trigger, service, action)

    # -- life cycle --------------------------------------------------------------------------------

    def configure(self) -> None:
        """Open the stage and take its place on the graph."""
        self.stage = self._make_stage(self.parameters)
        try:
            self.claim(MEASUREMENT, 'stage')
        except NodeError:
            self._release_stage()
            raise
        self.sequence = self.parameters.first_sequence - 1
        self._publisher = self.create_publisher(Measurement, MEASUREMENT, sample_qos())
        if self._lockstep:
            self._subscription = self.create_subscription(
                Currents, CURRENTS, self._on_answer, sample_qos()
            )
        else:
            self._queues = Queues(self)
            self._newest_currents = self._queues.subscribe(CURRENTS, Currents)

    def activate(self) -> None:
        """Take the first sample and begin to sample."""
        self.get_logger().info(f'{self.parameters.mode}, waiting for a controller on {CURRENTS}')
        period, action = _REPEAT_PERIOD, self._watch_lockstep
        if not self._lockstep:
            period, action = self.tick_period, self._on_tick
            self.take_realtime_priority()
        self.start_stage()
        self._answered = self._armed = False
        self._currents_sequence = -1
        self._sample = self.stage.read()
        self.sequence += 1
        self._first_sequence = self.sequence
        self._sample_wall_time = self._first_tick = time.monotonic()
        self._timer = self.create_timer(period, action, clock=self.steady_clock)

    def deactivate(self) -> None:
        """End sampling, with no current flowing."""
        self.destroy_timer(self._timer)
        self._timer = None
        self.stop_stage()

    def cleanup(self) -> None:
        """Release the stage and leave the graph."""
        if self._timer is not None:
            self.destroy_timer(self._timer)
        self._release_stage()
        self.destroy_publisher(self._publisher)
        if self._subscription is not None:
            self.destroy_subscription(self._subscription)
        self._leave_queues()
        self._publisher = self._subscription = self._timer = None

    def _leave_queues(self) -> None:
        if self._queues is not None:
            self._queues.destroy()
        self._queues = self._newest_currents = None

    def _release_stage(self) -> None:
        stage, self.stage = self.stage, None
        if stage is not None:
            stage.close()

    def start_stage(self) -> None:
        """What a stage needs before its first sample."""

    def stop_stage(self) -> None:
        """What a stage needs after its last sample; no current flows afterwards."""
        self.stage.write(self._zero, self._zero)

    @property
    def tick_period(self) -> float:
        """Real time: how long after one tick the next is attended to [s]."""
        return self.sample_time

    # -- lockstep ----------------------------------------------------------------------------------

    def _on_answer(self, message: Currents) -> None:
        if message.sequence != self.sequence or self._timer is None:
            return
        if not (self._answered or self.watched()):
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
            self.unanswered(f'no currents for sample {self.sequence} within {waited:.1f} s: {who}')

    def unanswered(self, message: str) -> None:
        """Lockstep: no answer came in time; ``message`` says whose it was."""
        self.fail(message)

    # -- real time ---------------------------------------------------------------------------------

    def take_currents(self) -> None:
        """The newest currents that have arrived; called at the tick, so that none come too late."""
        assert self._newest_currents is not None
        for message, _ in self._newest_currents.take():
            self._currents_sequence = message.sequence
            self._direct = message.direct_current
            self._quadrature = message.quadrature_current
            # A controller that catches up with what it missed at its start is not late.
            self._answered |= message.sequence >= self.sequence - 1

    def _on_tick(self) -> None:
        due = self._first_sequence + int((time.monotonic() - self._first_tick) / self.sample_time)
        behind = (due - self.sequence) * self.sample_time
        if behind > self.parameters.overrun_limit:
            self.fail(
                f'{behind:.2f} s behind the clock at sample {self.sequence}: this machine is too'
                ' slow or too busy for real time; free a core, or use mode lockstep'
            )
            return
        # Held up, it catches up two samples at a time: in a longer burst no answer could reach it,
        # and its own delay would look like the controller's.
        self._tick()
        if due > self.sequence:
            self._tick()

    def _tick(self) -> None:
        self.take_currents()
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
            self.lost(error)
            return
        self.sequence += 1
        self._sample_wall_time = time.monotonic()
        self._publish()

    def lost(self, error: StageError) -> None:
        """The stage gives no samples any more."""
        self.fail(str(error))

    def _publish(self) -> None:
        assert self._sample is not None
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
        watchers = self.parameters.watchers
        listeners = watchers + 2 if watchers else 1  # the controller, and the reference
        return bool(self._publisher.get_subscription_count() >= listeners)

    def publish_more(self) -> None:
        """What a stage publishes beside each measurement."""

    def heeds(self, direct_current: Any, quadrature_current: Any) -> bool:
        """Whether currents are followed: from when they have been zero, see the class."""
        if not self._armed:
            flowing = np.any(direct_current) or np.any(quadrature_current)
            self._armed = self._answered and not flowing
        return self._armed

    def _apply(self, direct_current: Any, quadrature_current: Any) -> None:
        if self.fault is None and self.heeds(direct_current, quadrature_current):
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
        if self.fault is not None:
            self.fault, self._armed = None, False
        return response

    def on_parameters(self, parameters: Any) -> None:
        """Only the time-outs change while running."""
        changeable = {
            name: getattr(parameters, name) for name in _TIMEOUTS if hasattr(parameters, name)
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
        if self.state != 'active':
            return DiagnosticStatus.OK, self.state, facts
        if self.fault is not None:
            return DiagnosticStatus.ERROR, f'currents cut: {self.fault}', facts
        if not self._answered:
            return DiagnosticStatus.WARN, 'waiting for a controller', facts
        if not self._armed:
            return (
                DiagnosticStatus.WARN,
                'no current until the controller has commanded none',
                facts,
            )
        if self.late_samples:
            return DiagnosticStatus.WARN, 'some currents came late', facts
        return DiagnosticStatus.OK, 'running', facts

    def close(self) -> None:
        """No current flows, and the stage is released."""
        self._release_stage()
        self._leave_queues()
