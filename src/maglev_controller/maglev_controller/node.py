"""The controller's node: answers every measurement with currents."""

from __future__ import annotations

import dataclasses
import secrets
import time
from collections.abc import Callable, Mapping
from operator import attrgetter
from typing import Any, ClassVar

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import SetBool, Trigger

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_model.contract.controller_watch import NOBODY
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import KEPT
from maglev_model.parameters import build, parameter, specs, values
from maglev_node.graph_guard import GraphGuard, Watchers
from maglev_node.mode_check import StageCheck
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.samples import ProgressWriter, SampleQueue, SampleWriter, hear
from maglev_node.topics import (
    CONTROLLER_PROGRESS,
    CONTROLLER_STATE,
    CURRENTS,
    MEASUREMENT,
    REFERENCE,
    SAMPLE_TOPICS,
    SILENCE,
    reference_qos,
    sample_qos,
)

_REFERENCE_PERIOD = 2e-3  # between two looks at what references have arrived [s]
_HAND_PERIOD = 2e-4  # between two looks at the queues during a redesign [s]
_AT_ONCE = 8  # measurements in one such look: a stage in lockstep has the next one ready at once
_WATCH_PERIOD = 0.05  # between two looks at an answer that waits [s]
_IDLE_PATIENCE = 0.04  # for a reference without which nothing is lost [s]
_ROW = attrgetter('sequence', 'phase', 'segment', 'position', 'velocity', 'acceleration', 'session')


@dataclasses.dataclass(frozen=True, kw_only=True)
class ControllerNodeParameters(SourceParameters, ControllerParameters):
    """The regulator and how its node runs it."""

    enabled: bool = parameter(True, 'from the start; false: by ~/enable', read_only=True)
    reference_timeout: float = parameter(
        4.0,
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

    interface: ClassVar[Mapping[str, str]] = {
        MEASUREMENT: 'subscribed: what the encoders read, each sample',
        REFERENCE: 'subscribed: where the platen shall be, ahead of time',
        CURRENTS: 'published: the currents that answer a sample',
        CONTROLLER_STATE: 'published: mode, errors and internal models of each sample',
        CONTROLLER_PROGRESS: 'published: the same, while it regulates every sixteenth',
        '~/enable': 'std_srvs/SetBool: follow the reference; false: land',
        '~/emergency_stop': 'std_srvs/Trigger: land, and end in a fault',
        '~/reset': 'std_srvs/Trigger: clear a fault',
        '~/learn': 'std_srvs/SetBool: learn over the next passes; false: no more',
    }
    changeable = specs(ControllerNodeParameters)

    def __init__(self) -> None:
        super().__init__('controller', ControllerNodeParameters)
        self._lockstep = self.parameters.mode == 'lockstep'
        law, enabled = self._law(self.parameters), self.parameters.enabled
        self.supervisor = Supervisor(law, enabled=enabled, hurried=not self._lockstep)
        self._longest_gap = self.parameters.measurement_timeout / self.parameters.sample_time
        self._stage_check = StageCheck(self.parameters.mode, self.parameters.sample_time)
        self._sequence = -1
        self._pending: Any = None  # measurement that waits for its reference
        self._pending_since = self._answered = 0.0
        self._reference_lost = self._reference_over = self._silent = False
        learning = self.supervisor.learning
        self._learned = learning.learned if learning else np.zeros(0)  # when last looked at
        self._logged = (self.supervisor.mode, self.supervisor.reason)
        self._session = secrets.randbits(64) | 1
        GraphGuard(self, lambda: self.supervisor.flying).claim(CURRENTS, 'controller')
        qos = sample_qos(KEPT[self.parameters.mode])
        self._currents = SampleWriter(self, CURRENTS, qos)
        self._currents['session'] = self._session
        self._state = SampleWriter(self, CONTROLLER_STATE, qos)
        self._progress = ProgressWriter(self, CONTROLLER_PROGRESS, self._state)
        self._watchers = Watchers(self, self.parameters.watchers, CURRENTS, CONTROLLER_STATE)
        self._references = SampleQueue(self, REFERENCE, reference_qos())
        self._wanted = f'waiting for a reference on {self._references.raw.topic}'
        self._measurements = hear(self, MEASUREMENT, self._on_measurement)
        self._by_hand = (
            self.create_service(Trigger, '~/emergency_stop', self._on_emergency_stop),
            self.create_service(SetBool, '~/enable', self._on_enable),
            self.create_service(Trigger, '~/reset', self._on_reset),
        )
        self.create_service(SetBool, '~/learn', self._on_learn)
        self.create_timer(_REFERENCE_PERIOD, self._take_references, clock=self.steady_clock)
        self.create_timer(_WATCH_PERIOD, self._watch, clock=self.steady_clock)
        for line in self.supervisor.regulator.describe_loops():
            self.get_logger().info(line)
        # The first line a process logs takes 20 ms, so it must not be one that is logged in flight.
        where = self._measurements.topic_name
        self.get_logger().info(f'{self.parameters.mode}, waiting for {where}')

    def _take_references(self) -> None:
        """Take what has arrived ahead of time, in bursts: being woken for each slows the loop."""
        references = self.supervisor.references
        for message in self._references.take():
            if self.supervisor.flying and message.session != references.session:
                self.get_logger().warning('another reference is not followed', once=True)
                continue  # it finds the first and leaves
            references.store(*_ROW(message))
            self._reference_lost, self._reference_over = False, message.phase == Phase.END
        self._answer_pending()

    def _on_measurement(self, message: Any) -> None:
        sequence = message.sequence
        if self._runs_otherwise(message) or self._anothers(message):
            return
        if self._sequence < 0 and not self._watchers.there():
            return
        if sequence == self._sequence:  # repeated: the answer was not heard
            self._currents.publish()
            return
        if sequence < self._sequence:
            if self.supervisor.flying and not self._stage_is_silent():
                return  # of a second stage, which will find the first and leave
            self.get_logger().warning('the stage began anew')
            self.supervisor.restart()
            self._sequence, self._pending = -1, None
            self._reference_lost = self._reference_over = False
        elif sequence - self._sequence > self._longest_gap and self.supervisor.flying:
            self.supervisor.stop(f'{sequence - self._sequence - 1} measurements are missing')
        if self.supervisor.references.newest < sequence:
            self._keep_pending(message)  # for the landing, should this fail
            self._take_references()
            if self._sequence == sequence:  # it is answered
                return
        if self._lockstep and self._awaits_reference(sequence):
            self._keep_pending(message)
            return
        self._answer(message)

    def _keep_pending(self, message: Any) -> None:
        if self._pending is None or self._pending.sequence != message.sequence:
            self._pending, self._pending_since = message, time.monotonic()

    def _runs_otherwise(self, message: Any) -> bool:
        """Whether the stage has another mode or sample time, with which there is no working."""
        if self.supervisor.flying:  # then it is a second stage, which will leave
            return bool(message.lockstep != self._lockstep)
        if conflict := self._stage_check.conflict(message):
            self.fail(conflict)
        return bool(conflict)

    def _anothers(self, message: Any) -> bool:
        """Whether another controller flies this stage, into which we must not speak.

        The graph tells of it too, but on a busy machine only later.
        """
        another = message.controller not in (NOBODY, self._session)
        if another and not self._silent:
            self.get_logger().warning(
                f'silent since sample {message.sequence}: another controller flies this stage'
            )
        self._silent = another
        return another

    def _awaits_reference(self, sequence: int) -> bool:
        """Whether an answer waits; without current only so that the loop sleeps, see _watch."""
        known = self.supervisor.references.find(sequence) >= 0
        return not known and self.supervisor.mode != Mode.LANDING

    def _answer(self, message: Any) -> None:
        self._pending = None
        self._answered = time.monotonic()
        supervisor = self.supervisor
        sequence = self._sequence = message.sequence
        row = supervisor.references.find(sequence)
        if row < 0 and self._reference_over and supervisor.references.newest < sequence:
            row = supervisor.references.find(supervisor.references.newest)
        supervisor.step(row, message.gap, message.x, message.z)
        self._currents.set_stamp(message.stamp)
        self._publish_currents(sequence)
        self._publish_state(message.stamp, sequence)
        if (supervisor.mode, supervisor.reason) != self._logged:
            self._log_change()
            self._save_learned()

    def _publish_currents(self, sequence: int) -> None:
        message = self._currents
        message['sequence'] = sequence
        message['direct_current'] = self.supervisor.direct_current
        message['quadrature_current'] = self.supervisor.quadrature_current
        message['status'] = self.supervisor.status
        message.publish()

    def _publish_state(self, stamp: int, sequence: int) -> None:
        message, regulator = self._state, self.supervisor.regulator
        message.set_stamp(stamp)
        message['sequence'] = sequence
        message['mode'] = self.supervisor.mode
        message['limited_by'] = self.supervisor.limited_by
        message['saturated'] = self.supervisor.limited_by != 0
        message['position'] = regulator.position
        message['error'], message['error_rate'] = regulator.error, regulator.error_rate
        message['virtual_input'] = regulator.virtual_input
        message['internal_model'] = regulator.internal_model
        message.publish()
        self._progress.publish(sequence, steady=self.supervisor.mode == Mode.REGULATING)

    def _log_change(self) -> None:
        mode, reason = self._logged = (self.supervisor.mode, self.supervisor.reason)
        text = f'{mode.name.lower()} at sample {self._sequence}' + (f': {reason}' if reason else '')
        if mode in (Mode.FAULT, Mode.LANDING):
            self.get_logger().error(text)
        else:
            self.get_logger().info(text)

    def _watch(self) -> None:
        """In lockstep, give a lost reference up: the answer that waits for it starts a landing.

        Where no current is wanted there is nothing to lose. A run's first answer waits for ever.
        """
        if self._unreferenced:
            self._watchers.remind(self._wanted)
        if self._pending is None or (self._unreferenced and self._sequence < 0):
            return
        over = self._reference_over or self._reference_lost or self.supervisor.references.newest < 0
        needless = not self.supervisor.flying and (over or self.supervisor.mode != Mode.WAITING)
        patience = _IDLE_PATIENCE if needless else self.parameters.reference_timeout
        if time.monotonic() - self._pending_since > patience:
            self._reference_lost |= not needless
            self._answer(self._pending)

    @property
    def _unreferenced(self) -> bool:
        """Whether there is a stage, but there was no reference yet."""
        heard, references = self._pending or self._sequence >= 0, self.supervisor.references
        return bool(heard) and self.supervisor.mode == Mode.WAITING and references.newest < 0

    def may_stop(self) -> bool:
        """Land before ending, unless the stage is silent."""
        if self.supervisor.flying and self.supervisor.mode != Mode.LANDING:
            self.supervisor.disable()
            self._answer_pending()
        return not self.supervisor.flying or self._stage_is_silent()

    def _stage_is_silent(self) -> bool:
        return time.monotonic() - self._answered > SILENCE[self.parameters.mode]

    def _on_enable(self, request: Any, response: Any) -> Any:
        action = self.supervisor.enable if request.data else self.supervisor.disable
        response.success, response.message = action()
        self._answer_pending()
        return response

    def _on_emergency_stop(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self.supervisor.stop('emergency stop')
        self._answer_pending()
        return response

    def _on_reset(self, _request: Any, response: Any) -> Any:
        response.success, response.message = self.supervisor.reset_fault()
        return response

    def _on_learn(self, request: Any, response: Any) -> Any:
        learning = self.supervisor.learning
        response.success = learning is not None and self.parameters.learning.passes > 0
        if learning is None or not response.success:
            response.message = "nothing repeats: give 'learning.period' and 'learning.passes'"
        elif request.data:
            learning.begin()
            response.message = f'learning over {self.parameters.learning.passes} passes'
        else:
            learning.end()
            response.message = learning.describe()
            self._save_learned()
        return response

    def _save_learned(self) -> None:
        """On the ground, where the time does not matter."""
        learning, flying = self.supervisor.learning, self.supervisor.flying
        if learning is None or flying or np.array_equal(learning.learned, self._learned):
            return
        self._learned = learning.learned
        self.get_logger().info(learning.describe())
        try:
            if path := self.parameters.learning.file:
                learning.save(path)
        except OSError as error:
            self.get_logger().error(f'what was learned is not saved: {error}')

    def _answer_pending(self) -> None:
        if self._pending is not None and not self._awaits_reference(self._pending.sequence):
            self._answer(self._pending)

    def on_parameters(self, parameters: ControllerNodeParameters) -> None:
        """Redesign in another process; the loop is served between all that takes a millisecond."""
        self._serve_by_hand()
        law = self._law(parameters)
        self._serve_by_hand()
        if law != self.supervisor.parameters:
            design = self.supervisor.redesign(law)
            while not design.done:
                if self.ending():
                    design.end()
                self._serve_by_hand()
                time.sleep(_HAND_PERIOD)
            regulator = design.result()
            self._serve_by_hand()
            self.supervisor.adopt(*regulator)
        self._longest_gap = parameters.measurement_timeout / parameters.sample_time

    @staticmethod
    def _law(parameters: ControllerNodeParameters) -> ControllerParameters:
        """The node's parameters without those that are only the node's."""
        table, given = specs(ControllerParameters), values(parameters)
        return build(ControllerParameters, {k: v for k, v in given.items() if k in table})

    def _serve_by_hand(self) -> None:
        """What the executor does for the loop and who stops it, while it is away; never long."""
        for service in self._by_hand:
            with service.handle:
                request, header = service.handle.service_take_request(service.srv_type.Request)
            if header is not None:
                response = service.callback(request, service.srv_type.Response())
                service.send_response(response, header)
        self._take_references()
        with self._measurements.handle:
            for _ in range(_AT_ONCE):
                taken = self._measurements.handle.take_message(SAMPLE_TOPICS[MEASUREMENT], True)
                if taken is None:
                    return
                self._measurements.callback(taken[0])

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR in a fault, in a landing nobody asked for; WARN without stage or reference."""
        supervisor = self.supervisor
        facts: dict[str, object] = {'mode': supervisor.mode.name, 'sequence': self._sequence}
        if (foreign := supervisor.regulator.foreign) is not None:
            facts['law_longest_time'], facts['law_too_long'] = foreign.worst, foreign.late
        failed = supervisor.mode in (Mode.FAULT, Mode.LANDING) or 'landed' in supervisor.reason
        if failed and 'disabled' not in supervisor.reason:
            return DiagnosticStatus.ERROR, f'{supervisor.mode.name}: {supervisor.reason}', facts
        if self._unreferenced:
            return DiagnosticStatus.WARN, self._wanted, facts
        if self._pending is None and self._sequence > 0 and self._stage_is_silent():
            text = f'no measurement for {time.monotonic() - self._answered:.1f} s'
            return DiagnosticStatus.WARN, text, facts
        return DiagnosticStatus.OK, supervisor.reason or supervisor.mode.name.lower(), facts

    def spin(self, stop: Callable[[], bool]) -> None:
        """Serve the graph; however that ends, in flight a landing comes before the end."""
        try:
            self.take_realtime_priority()
            super().spin(stop)
        except Exception as error:
            self.supervisor.stop(f'defect: {error!r}')
            raise
        finally:
            self._land_by_hand()

    def _land_by_hand(self) -> None:
        """Land, without an executor, unless the stage is silent or a landing that fails."""
        if self.supervisor.mode == Mode.REGULATING:
            self.supervisor.disable()
        self._answered = time.monotonic()  # from now on it has its time
        while self.supervisor.flying and not self._stage_is_silent():
            self._answer_pending()
            self._serve_by_hand()
            time.sleep(_HAND_PERIOD)

    def close(self) -> None:
        """In flight the last word is that the controller gives up: the stage comes down alone."""
        if self.supervisor.flying:
            self.supervisor.give_up('shut down')
            self._publish_currents(self._sequence)
