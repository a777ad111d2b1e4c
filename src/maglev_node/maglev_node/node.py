"""The node every node is: typed parameters, diagnostics, bounded spinning, an orderly end."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.subscription import Subscription
from rclpy.task import Future
from rclpy.time_source import CLOCK_TOPIC

from maglev_model import parameters as table
from maglev_model.contract.wire import HARDWARE_ID
from maglev_model.parameters import ParameterError, parameter
from maglev_model.programs.command import write_no_more
from maglev_node import discovery, realtime, ros_parameters
from maglev_node.polling import PollingNode
from maglev_node.topics import CLOCK, DIAGNOSTICS

_SPIN_BOUND = 0.1
"""Longest wait inside the executor [s]; signals are seen at least this often."""


class NodeError(RuntimeError):
    """A node cannot start or go on; the message says why and what to do."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class NodeParameters:
    """What every node takes."""

    effective_parameters: str = parameter(
        '', 'file to write the parameters in effect to; empty: none', read_only=True
    )
    processors: tuple[int, ...] = parameter(
        (),
        'processors that the threads of the process may run on; empty: any',
        within=(0, 4095),
        read_only=True,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class SourceParameters(NodeParameters):
    """What every node of the loop takes: stage, controller and reference."""

    mode: str = parameter(
        'lockstep',
        'lockstep: each sample waits for its answer; realtime: by the clock',
        choices=('lockstep', 'realtime'),
        read_only=True,
    )
    realtime_priority: int = parameter(
        40,
        'realtime: SCHED_FIFO priority of the process, where permitted; 0: none',
        within=(0, 98),
        read_only=True,
    )
    watchers: tuple[str, ...] = parameter(
        (),
        'names of nodes in this namespace that watch every sample, waited for at start, and in'
        ' lockstep where they tell on NAME/progress that they are behind',
        read_only=True,
    )


P = TypeVar('P', bound=NodeParameters)


class MaglevNode(PollingNode, Generic[P]):
    """A node with a parameter table, ``diagnostics`` at 1 Hz and an orderly end.

    A subclass ends the process by :meth:`finish`; what it must do last (no current, a closed bag)
    it does in :meth:`close`, which runs however the process ends, publishers still working.
    """

    interface: ClassVar[Mapping[str, str]] = {}
    """The topics and services of the node, each with what it is, for ``--help``."""

    changeable: ClassVar[Container[str]] = ()
    """The parameters that may change while the node runs, but for those that are read-only."""

    def __init__(self, name: str, parameter_table: type[P], **node_options: Any) -> None:
        super().__init__(name, start_parameter_services=False, **node_options)
        self.at_end = ExitStack()
        """What is closed with the node, after its publishers and all."""
        self.parameters: P = ros_parameters.declare(self, name, parameter_table, self.changeable)
        self._parameter_service = ros_parameters.ParameterService(self, parameter_table)
        realtime.take_processors(self.parameters.processors)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.steady_clock = Clock(clock_type=ClockType.STEADY_TIME)
        self.finished: Future = Future()
        """Done when the node has finished."""
        self.exit_code: int | None = None
        self.failed = False
        """Whether what is wrong was said by :meth:`fail`."""
        self.ending: Callable[[], bool] = lambda: False
        """Whether a signal has told the process to end: nothing that takes its time is begun."""
        self.in_process = {self.get_name()}
        """The names of the nodes of this process, which see each other without a network."""
        self.discovering_since = discovery.begun()
        """When the middleware began to find who else is on the graph [s, monotonic]."""
        self._said_refused = False
        self._diagnostics = self.create_publisher(DiagnosticArray, DIAGNOSTICS, 10)
        self.create_timer(1.0, self._publish_diagnostics, clock=self.steady_clock)
        if self.parameters.effective_parameters:
            self._write_effective_parameters(Path(self.parameters.effective_parameters))

    def create_subscription(
        self, msg_type: Any, topic: str, *args: Any, **kwargs: Any
    ) -> Subscription[Any]:
        """As rclpy, which itself hears time on the absolute /clock: here it is relative as well."""
        topic = CLOCK if topic == CLOCK_TOPIC else topic
        return super().create_subscription(msg_type, topic, *args, **kwargs)

    def finish(self, exit_code: int = 0) -> None:
        """Have done, with this exit code, which ends the process once the running callback returns.

        A process of several nodes ends when all have done, or one has failed.
        """
        if self.exit_code is None:
            self.exit_code = exit_code
            self.finished.set_result(None)

    def fail(self, message: str) -> None:
        """Say what is wrong in one line, once, and end the process with exit code 1.

        What had queued up is still dispatched before the process ends.
        """
        if self.exit_code is None:
            self.get_logger().error(message)
            self.failed = True
            self.finish(1)

    def show(self, text: str) -> None:
        """Print; a standard output that cannot be written is said once, and no reason to end."""
        try:
            print(text, flush=True)
        except OSError as error:
            write_no_more()
            reason = f'cannot write to the standard output any more: {error.strerror}'
            self.get_logger().warning(reason)

    def close(self) -> None:
        """What must happen last; publishers still work. Must be quick and must not raise."""

    def destroy_node(self) -> None:
        """Leave the graph, and close what is to be closed then."""
        super().destroy_node()
        self.at_end.close()

    def rescue(self) -> None:
        """What cannot wait until :meth:`close` when a callback has raised; must not raise."""

    def take_realtime_priority(self) -> None:
        """In real time, keep the heap, and take SCHED_FIFO and lock memory, where permitted.

        For nodes with :class:`SourceParameters`, when all is built that takes long, which would
        keep others from the processor, and when publishers and subscriptions exist, so that the
        middleware's threads do too. What is not permitted is said once.
        """
        parameters: Any = self.parameters
        if parameters.mode != 'realtime':
            return
        refused = realtime.take(parameters.realtime_priority)
        if refused and not self._said_refused:
            self._said_refused = True
            self.get_logger().warning(f'not permitted: {", ".join(refused)}: samples may come late')

    def may_stop(self) -> bool:
        """Whether a signal may end the process now; asked again and again until it may.

        After a second signal it is asked only once more.
        """
        return True

    def on_parameters(self, parameters: P) -> None:
        """Take new, valid parameters while running. Raises ParameterError to refuse them."""

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Level (REP-107), message and values for ``/diagnostics``."""
        return DiagnosticStatus.OK, 'running', {}

    def _on_set_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        ours = {p.name: p.value for p in changes if not ros_parameters.is_ros_own(p.name)}
        if not ours:
            return SetParametersResult(successful=True)
        if self.ending():
            return SetParametersResult(successful=False, reason='the node is told to end')
        try:
            changed = table.replace(self.parameters, ours)
            self.on_parameters(changed)
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        self.parameters = changed
        return SetParametersResult(successful=True)

    def _publish_diagnostics(self) -> None:
        level, message, values = self.diagnose()
        status = DiagnosticStatus(level=level, name=self.get_name(), message=message)
        status.hardware_id = HARDWARE_ID
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _write_effective_parameters(self, path: Path) -> None:
        """All but where they are written: who is given the file leaves it as it is."""
        written = dataclasses.replace(self.parameters, effective_parameters='')
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(table.to_yaml(written, self.get_name()), encoding='utf-8')
        except OSError as error:
            raise NodeError(
                f"cannot write the effective parameters to '{path}': {error}"
            ) from error

    def spin(self, stop: Callable[[], bool]) -> None:
        """Serve the graph until :meth:`finish` or until ``stop()`` holds; every wait is bounded."""
        spin([self], stop)


def spin(nodes: Sequence[MaglevNode[Any]], stop: Callable[[], bool]) -> None:
    """Serve the graph with the nodes of a process until all have finished or one has failed.

    Or until ``stop()`` holds; every wait is bounded.
    """
    executor = EventsExecutor()
    for node in nodes:
        executor.add_node(node)
    try:
        while not stop() and not any(node.failed for node in nodes):
            unfinished = [node for node in nodes if node.exit_code is None]
            if not unfinished:
                break
            executor.spin_until_future_complete(unfinished[0].finished, timeout_sec=_SPIN_BOUND)
    except Exception:
        for node in nodes:
            node.rescue()
        raise
    finally:
        for node in nodes:
            executor.remove_node(node)
        executor.shutdown()
