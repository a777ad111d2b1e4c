"""The node that every stage is: one class over different back ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Generic, TypeVar

from diagnostic_msgs.msg import DiagnosticStatus
from std_srvs.srv import Trigger

from maglev_model.contract.stage import Stage
from maglev_node.graph_guard import GraphGuard
from maglev_node.managed_node import ManagedNode
from maglev_node.node import NodeError
from maglev_node.sampling import Sampling
from maglev_node.stage_parameters import StageNodeParameters
from maglev_node.topics import CLOCK, CURRENTS, MEASUREMENT, STAGE_PROGRESS, progress_of

P = TypeVar('P', bound=StageNodeParameters)
S = TypeVar('S', bound=Stage)


class StageNode(ManagedNode[P], Generic[P, S]):
    """Publishes the encoders of a :class:`~maglev_model.contract.stage.Stage`, gives it currents.

    Configured, it holds its stage and its place on the graph; active, it samples; deactivated or
    told to end in flight, it lands first. A fault of the stage is latched until ``~/reset``. How
    samples are taken: :class:`~maglev_node.sampling.Sampling`.
    """

    interface: ClassVar[Mapping[str, str]] = {
        MEASUREMENT: 'published: what the encoders read, each sample',
        STAGE_PROGRESS: 'published: the same, in flight every sixteenth',
        CURRENTS: 'subscribed: the currents that answer a sample',
        CLOCK: 'published in lockstep: stage time',
        **dict.fromkeys(
            map(progress_of, ('recorder', 'monitor')),
            'subscribed in lockstep, where watchers names it: how far it is',
        ),
        '~/emergency_stop': "std_srvs/Trigger: latch a fault, see the fault's remedy",
        '~/reset': 'std_srvs/Trigger: clear a fault',
        '~/change_state': 'lifecycle_msgs/ChangeState, with the other life-cycle services',
    }
    changeable = ('answer_timeout', 'watchdog', 'overrun_limit')

    def __init__(self, name: str, parameter_table: type[P], make_stage: Callable[[P], S]) -> None:
        super().__init__(name, parameter_table)
        self._graph = GraphGuard(self, lambda: self.configured and self.stage.flying)
        self._make_stage = make_stage
        self._sampling: Sampling[P, S] | None = None
        self.offer('~/emergency_stop', self._emergency_stop)
        self.offer('~/reset', lambda: self.sampling.reset())

    @property
    def configured(self) -> bool:
        """Whether it holds a stage."""
        return self._sampling is not None

    @property
    def sampling(self) -> Sampling[P, S]:
        """What takes the stage's samples. Raises NodeError while there is no stage."""
        if self._sampling is None:
            raise NodeError('not configured: there is no stage')
        return self._sampling

    @property
    def stage(self) -> S:
        """The stage. Raises NodeError while there is none."""
        return self.sampling.stage

    def offer(self, service: str, action: Callable[[], tuple[bool, str]]) -> None:
        """A Trigger service that answers with success and message; a NodeError is a refusal."""

        def serve(_request: Any, response: Any) -> Any:
            try:
                response.success, response.message = action()
            except NodeError as error:
                response.success, response.message = False, str(error)
            return response

        self.create_service(Trigger, service, serve)

    def require_active(self) -> None:
        """Raise NodeError unless the node is active."""
        if self.state != 'active':
            raise NodeError(f'{self.state}: no current flows')

    # -- life cycle --------------------------------------------------------------------------------

    def configure(self) -> None:
        """Take its place on the graph, then get hold of the stage."""
        stage = self._make_stage(self.parameters)
        self._graph.claim(MEASUREMENT, 'stage')
        try:
            stage.configure()
        except Exception:
            stage.close()
            self._graph.release()
            raise
        self._sampling = Sampling(self, stage)

    def activate(self) -> None:
        """Take the first sample and begin to sample."""
        where = self.resolve_topic_name(CURRENTS)
        self.get_logger().info(f'{self.parameters.mode}, waiting for a controller on {where}')
        self.take_realtime_priority()
        self.sampling.start()

    def deactivate(self) -> None:
        """Land, and end sampling with no current flowing."""
        self.sampling.stop()

    def cleanup(self) -> None:
        """Release the stage and leave the graph."""
        if self._sampling is not None:
            self._sampling.close()
            self._sampling = None
            self._graph.release()

    def may_stop(self) -> bool:
        """Land before the process ends."""
        if self.state == 'active':
            self.sampling.land('shut down')
        return True

    def rescue(self) -> None:
        """Land, where that still works, before a defect ends the node."""
        if self._sampling is None:
            return
        try:
            self._sampling.land('a defect of the node')
        except Exception as error:
            self.get_logger().fatal(f'no landing: {error!r}')
            self._sampling.release()

    def close(self) -> None:
        """No current flows, and the stage is released."""
        if self._sampling is not None:
            self._sampling.release()

    # -- services, parameters, diagnostics ---------------------------------------------------------

    def _emergency_stop(self) -> tuple[bool, str]:
        self.require_active()
        return True, self.sampling.emergency_stop()

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """ERROR when a fault is latched, WARN when samples came late."""
        sampling = self._sampling
        if sampling is None:
            return DiagnosticStatus.OK, self.state, {'mode': self.parameters.mode}
        facts = {
            'mode': self.parameters.mode,
            'sequence': sampling.sequence,
            'late_samples': sampling.late_samples,
        }
        fault = sampling.stage.fault
        if fault is not None:
            facts = {**facts, 'fault': fault.kind, 'remedy': fault.remedy}
            return DiagnosticStatus.ERROR, str(fault), facts
        if self.state != 'active':
            return DiagnosticStatus.OK, self.state, facts
        if not sampling.answered:
            return DiagnosticStatus.WARN, f'waiting for {sampling.awaited()}', facts
        if not sampling.controller.taken_up:
            why = sampling.controller.why or 'no current flows until the controller commands none'
            return DiagnosticStatus.WARN, why, facts
        if sampling.late_samples:
            return DiagnosticStatus.WARN, 'some currents came late', facts
        return DiagnosticStatus.OK, 'running', facts
