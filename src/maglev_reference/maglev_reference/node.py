"""The reference node: publishes where the platen shall be, some samples ahead of the stage."""

from __future__ import annotations

import dataclasses
import secrets
import time
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from maglev_model.axes import FloatArray
from maglev_model.contract.controller_watch import NOBODY
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import KEPT
from maglev_model.geometry import outputs_of_gaps
from maglev_model.parameters import ParameterError, parameter
from maglev_msgs.srv import Step
from maglev_node.graph_guard import GraphGuard, Watchers, node_of
from maglev_node.mode_check import StageCheck
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.samples import SampleQueue, SampleWriter
from maglev_node.topics import (
    CONTROLLER_PROGRESS,
    PROGRESS_PERIOD,
    REFERENCE,
    SILENCE,
    STAGE_PROGRESS,
    reference_qos,
    sample_qos,
)
from maglev_reference.accuracy import summary, warnings
from maglev_reference.check import UnreachableError
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.run import ReferenceRun, samples_ahead
from maglev_reference.timeline import Timeline
from maglev_reference.trajectory_message import check_length, joints_and_points

_LOOK_PERIOD = 0.25  # between two looks at the graph while the stage is flown [s]
_MOST_AHEAD = 800  # samples; a controller holds 1024
_REMINDER = 5.0  # between two lines about what is waited for [s]
_IDLE_PERIOD = 0.02  # from one sample to the next while nothing shall move, in lockstep [s]
_PLANNED = ('phase', 'segment', 'position', 'velocity', 'acceleration', 'target')
_NEWS_TIME = 0.2  # in which an answer shows what a call has changed in the controller [s]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ReferenceNodeParameters(SourceParameters, ReferenceParameters):
    """The reference and how it is published."""

    autostart: bool = parameter(True, 'start by itself; false: by ~/lift_off', read_only=True)
    exit_at_end: bool = parameter(False, 'end the process when the run is over', read_only=True)
    lead: float = parameter(
        0.064, 'published ahead by so much, at least', unit='s', within=(0.001, 0.2), read_only=True
    )
    poll_period: float = parameter(
        0.004,
        'how often the newest measurement is looked at, wall clock',
        unit='s',
        within=(0.0005, 0.1),
        read_only=True,
    )
    timeout: float = parameter(
        12.0,
        'longest time without a measurement while running, wall clock; in lockstep longer than the'
        " stage's 'answer_timeout'",
        unit='s',
        within=(0.05, 600.0),
        read_only=True,
    )

    def __post_init__(self) -> None:
        """Refuse more samples ahead than a controller holds."""
        super().__post_init__()
        most = _MOST_AHEAD * self.sample_time
        if self.lead > most:
            raise ParameterError(
                f"parameter 'lead' is {self.lead:g} s, it must be at most {most:g}"
            )


class ReferenceNode(MaglevNode[ReferenceNodeParameters]):
    """Publishes ``reference`` by ``lead`` ahead of the newest measurement.

    It looks at the newest measurement on a short timer instead of being woken by each one. The
    first measurement seen once all watchers are there tells where the platen rests and becomes
    sample 0 of the timeline. In lockstep, which waits for it, it is slow while nothing shall move.
    """

    interface: ClassVar[Mapping[str, str]] = {
        REFERENCE: 'published: where the platen shall be, ahead of time',
        STAGE_PROGRESS: 'subscribed: what the encoders read, the newest',
        CONTROLLER_PROGRESS: 'subscribed: whether the controller follows, the newest',
        '~/trajectory': 'subscribed: trajectory_msgs/JointTrajectory to follow from a hover',
        '~/lift_off': 'std_srvs/Trigger: start from rest',
        '~/land': 'std_srvs/Trigger: land from wherever the platen is',
        '~/step': 'maglev_msgs/Step: from a hover, one axis by a distance',
    }

    def __init__(self) -> None:
        super().__init__('reference', ReferenceNodeParameters)
        Timeline(self.parameters)  # refuses what cannot be followed before anything is waited for
        for line in warnings(self.parameters):
            self.get_logger().warning(line)
        for line in summary(self.parameters):
            self.get_logger().info(line)
        self._graph = GraphGuard(self, lambda: not self._run.grounded)
        self._graph.claim(REFERENCE, 'reference')
        lead = samples_ahead(self.parameters.lead, self.parameters.sample_time)
        lead += PROGRESS_PERIOD - 1  # of the newest that may be heard of
        self._run = ReferenceRun(self.parameters, lead, self.parameters.autostart)
        self._watchers = Watchers(self, self.parameters.watchers, REFERENCE)
        self._seen = self._reminded = self._looked = time.monotonic()
        self._message = SampleWriter(self, REFERENCE, reference_qos(KEPT[self.parameters.mode]))
        self._message['session'] = secrets.randbits(64) | 1
        self._measurements = SampleQueue(self, STAGE_PROGRESS, sample_qos(1))
        self._states = SampleQueue(self, CONTROLLER_PROGRESS, sample_qos(1))
        self._lockstep = self.parameters.mode == 'lockstep'
        self._stage_check = StageCheck(self.parameters.mode, self.parameters.sample_time)
        self._measured: Any = None
        self._published = 0.0  # when, last
        self.create_subscription(JointTrajectory, '~/trajectory', self._on_trajectory, 1, raw=True)
        self.create_service(Trigger, '~/lift_off', self._lift_off)
        self.create_service(Trigger, '~/land', self._land)
        self.create_service(Step, '~/step', self._step)
        self.create_timer(self.parameters.poll_period, self._poll, clock=self.steady_clock)

    def _poll(self) -> None:
        """Take what is new, and publish what is due."""
        for state in self._states.take(1):
            if self._run.observe_controller(Mode(state.mode), state.sequence):
                self._seen = time.monotonic()
        news = self._take_measurement()
        if self.parameters.exit_at_end and self._run.over:
            self._end()
        elif not self._run.started:
            self._wait(news)
        elif not news:
            self._watch()
        if self._run.started:
            self._give_way()
            self._consider()
            self._publish()
            self._tell_phase()

    @property
    def _silent(self) -> float:
        """Time without a measurement [s]."""
        return time.monotonic() - self._seen

    @property
    def _is_silent(self) -> bool:
        """Whether the stage is taken for stopped."""
        return self._silent > SILENCE[self.parameters.mode]

    def _take_measurement(self) -> bool:
        """Take the newest measurement; false when there is none, or one to be left alone."""
        news = False
        for message in self._measurements.take(1):
            observed = self._run.observe(message.sequence, silent=self._is_silent)
            if observed and self._runs_alike(message):
                news, self._measured, self._seen = True, message, time.monotonic()
        return news

    def _runs_alike(self, message: Any) -> bool:
        """Whether the stage has our mode and sample time; in flight no other one can come."""
        if not self._run.grounded:
            return bool(message.lockstep == self._lockstep)
        conflict = self._stage_check.conflict(message)
        if conflict:
            self.fail(conflict)
        return not conflict

    def _wait(self, news: bool) -> None:
        # In real time nobody waits for the controller but us; in lockstep it waits for us.
        answered = self._lockstep or self._run.controller is not None
        if news and self._flown:
            self._leave_if_another()
        if news and answered and not self._flown and not self._watchers.missing():
            self._start()
        else:
            self._remind()

    @property
    def _flown(self) -> bool:
        """Whether currents flow: the platen comes down, or somebody flies it already."""
        return self._measured is not None and self._measured.controller != NOBODY

    def _leave_if_another(self) -> None:
        """End when the graph shows who flies the stage; on a busy machine that takes its time."""
        if time.monotonic() - self._looked > _LOOK_PERIOD:
            self._looked = time.monotonic()
            self._graph.alone()

    def _remind(self) -> None:
        if time.monotonic() - self._reminded > _REMINDER:
            self._reminded = time.monotonic()
            self.get_logger().info(self._waiting_for())

    def _waiting_for(self) -> str:
        if awaited := self._watchers.awaited():
            return awaited
        if self._measurements.raw.publisher_count() == 0:
            return f'waiting for a stage on {self._measurements.raw.topic}'
        if self._flown:
            return 'waiting for the stage to come to rest'
        return f'waiting for a controller on {self._states.raw.topic}'

    def _position(self) -> FloatArray:
        """The outputs (5,) [m, rad] that were measured last."""
        assert self._measured is not None
        gap, x, z = self._measured.gap, self._measured.x, self._measured.z
        return outputs_of_gaps(gap, x, z, self.parameters.machine.radius)

    def _start(self) -> None:
        if not self._graph.alone():
            return
        autostart = self._run.autostart
        try:
            timeline = self._run.plan(self._position())
        except UnreachableError as error:
            if not self._graph.on_probation():  # or another, not discovered yet, may be flying it
                self.fail(str(error))
            return
        self._take_measurement()
        if self._run.autostart != autostart:  # the stage began anew in the meantime
            return
        self._run.start(timeline)
        self._reminded = time.monotonic()
        start = 'starting' if autostart else 'resting until ~/lift_off'
        left = f'left the run, {self._run.left}: ' if self._run.left else ''
        self.get_logger().info(f'{left}{start} at sample {self._run.newest}')

    def _give_way(self) -> None:
        """Leave the run when the controller does not follow."""
        flying = not self._run.grounded
        reason = self._run.give_way()
        if reason and flying:
            self.get_logger().error(f'left the run at sample {self._run.newest}: {reason}')
        elif reason:
            self.get_logger().warning(f'resting, {self._way_back(reason)}')
        elif self._run.controller is None:
            self._remind()

    def _way_back(self, reason: str) -> str:
        """A reason, and the services to call for a lift-off."""
        _, calls = self._run.obstacle()
        publishers = self.get_publishers_info_by_topic(CONTROLLER_PROGRESS)
        controller = next(filter(None, map(node_of, publishers)), '')
        if not controller:
            return f'{reason}: nobody known publishes {self._states.raw.topic}'
        services = [f'{controller}/{call}' for call in calls]
        services.append(self.resolve_service_name('~/lift_off'))
        return f'{reason}: call {", then ".join(services)}'

    def _publish(self) -> None:
        slowly = self._lockstep and self._run.idle
        if slowly and time.monotonic() - self._published < _IDLE_PERIOD:
            return
        due = self._run.due(slowly=slowly)
        if due is None or self._measured is None:
            return
        self._published = time.monotonic()
        (first, block), message = due, self._message
        stage_time = self._measured.stamp
        period = round(1e9 * self.parameters.sample_time)
        for row in range(len(block.phase)):
            message['sequence'] = first + row
            ahead = first + row - self._measured.sequence
            message.set_stamp(stage_time + ahead * period)
            for field in _PLANNED:
                message[field] = getattr(block, field)[row]
            message.publish()

    def _tell_phase(self) -> None:
        """Say what the stage is asked to do now."""
        if self._run.enter_phase():
            self.get_logger().info(f'{self._run.phase.name} at sample {self._run.newest}')

    def _end(self) -> None:
        if self._run.left:
            self.fail(f'the run was left: {self._run.left}')
        else:
            self.finish(0)

    def _watch(self) -> None:
        if self._silent < self.parameters.timeout:
            return
        if self._run.grounded:  # another stage may follow
            if self._run.phase == Phase.END and self.parameters.exit_at_end:
                self._end()
            return
        self.fail(self._stopped())

    def _stopped(self) -> str:
        who = 'the stage, or the controller it waits for, has stopped'
        if self._measurements.raw.publisher_count() == 0:
            who = 'the stage is gone'
        return f'no measurement for {self._silent:.1f} s after sample {self._run.newest}: {who}'

    def _on_trajectory(self, data: bytes) -> None:
        """Take a trajectory in; it is checked in pieces, between which the hover goes on."""
        try:
            check_length(len(data))
            replaces = self._run.propose(*joints_and_points(_read(data)))
        except UnreachableError as error:
            self.get_logger().error(f'trajectory refused: {error}')
        else:
            self._tell_of_replacement(replaces)

    def _tell_of_replacement(self, replaces: bool) -> None:
        if replaces:
            self.get_logger().error('trajectory refused: before it was checked another motion came')

    def _consider(self) -> None:
        try:
            length = self._run.consider()
        except UnreachableError as error:
            self.get_logger().error(f'trajectory refused: {error}')
            return
        if length is not None:
            self.get_logger().info(f'following a trajectory of {length:g} s, then hovering')

    def _lift_off(self, _request: Any, response: Any) -> Any:
        until = time.monotonic() + _NEWS_TIME
        while self._run.obstacle()[0] and time.monotonic() < until:
            self._poll()
            time.sleep(self.parameters.poll_period)
        try:
            response.success, response.message = self._try_lift_off()
        except UnreachableError as error:
            response.success, response.message = False, str(error)
        return response

    def _try_lift_off(self) -> tuple[bool, str]:
        reason, _ = self._run.obstacle()
        if not self._run.started:
            return False, self._waiting_for()
        if self._is_silent:  # or it would lift off when the stage goes on, be that much later
            return False, f'lift-off refused: {self._stopped()}'
        if reason:
            return False, f'lift-off refused: {self._way_back(reason)}'
        if not self._run.lift_off(self._position()):
            return False, 'the reference is running'
        return True, 'lifting off'

    def _land(self, _request: Any, response: Any) -> Any:
        if not self._run.started:
            response.success, response.message = False, self._waiting_for()
        else:
            response.success = self._run.land()
            response.message = 'landing' if response.success else 'landing already, or landed'
        return response

    def _step(self, request: Any, response: Any) -> Any:
        """Answered when it is checked; in between, what is due goes out."""
        try:
            self._tell_of_replacement(self._run.propose_step(request.axis, request.distance))
            while (length := self._run.consider()) is None:
                self._take_measurement()
                self._publish()
        except UnreachableError as error:
            response.success, response.message = False, f'step refused: {error}'
        else:
            response.success = True
            response.message = f'{request.axis} steps in {length:g} s, then hovers'
            self.get_logger().info(response.message)
        return response

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """WARN while something is waited for, or a run was left."""
        if not self._run.started:
            return DiagnosticStatus.WARN, self._waiting_for(), {}
        facts = {
            'phase': self._run.phase.name,
            'sequence': self._run.newest,
            'ahead': self._run.ahead,
        }
        if self._run.left:
            return DiagnosticStatus.WARN, f'left the run: {self._run.left}', facts
        if self._is_silent:
            return DiagnosticStatus.WARN, f'no measurement for {self._silent:.1f} s', facts
        return DiagnosticStatus.OK, 'running', facts

    def spin(self, stop: Callable[[], bool]) -> None:
        """Serve the graph."""
        self.take_realtime_priority()
        super().spin(stop)


def _read(data: bytes) -> Any:
    try:
        return deserialize_message(data, JointTrajectory)
    except RuntimeError as error:  # which rclpy's are
        raise UnreachableError('the message is no trajectory_msgs/JointTrajectory') from error
