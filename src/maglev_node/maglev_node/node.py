"""The node every node is: typed parameters, diagnostics, bounded spinning, clean endings."""

from __future__ import annotations

import dataclasses
import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Generic, TypeVar

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from maglev_model import parameters as table
from maglev_model.parameters import ParameterError, parameter
from maglev_node import ros_parameters
from maglev_node.dds import prepare_middleware
from maglev_node.topics import DIAGNOSTICS

DISCOVERY_TIME = 1.0
"""How long a node looks for others of its kind before it takes its place on the graph [s]."""

_PROBATION = 5.0
"""How long it goes on looking afterwards, and is the one to leave [s]."""

_DELIVERY_TIME = 0.5
"""Longest wait at the end for readers to have what was published [s]."""

_BACKGROUND_NICENESS = 5

_SPIN_BOUND = 0.1
"""Longest wait inside the executor [s]; signals are seen at least this often."""


class NodeError(RuntimeError):
    """A node cannot start or go on; the message says why and what to do."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class NodeParameters:
    """What every node takes."""

    effective_parameters: str = parameter(
        '',
        description='file to write the parameters in effect to; empty: none',
        read_only=True,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class SourceParameters(NodeParameters):
    """What every node of the loop takes: stage, controller and reference."""

    mode: str = parameter(
        'lockstep',
        choices=('lockstep', 'realtime'),
        description='lockstep: each sample waits for its answer; realtime: by the clock',
        read_only=True,
    )
    realtime_priority: int = parameter(
        40,
        lower=0,
        upper=98,
        description='realtime: SCHED_FIFO priority of the process, where permitted; 0: none',
        read_only=True,
    )
    watchers: int = parameter(
        0,
        lower=0,
        upper=100,
        description='nodes that watch every sample (monitor, recorder), waited for at the start',
        read_only=True,
    )


P = TypeVar('P', bound=NodeParameters)


class MaglevNode(Node, Generic[P]):
    """A node with a parameter table, ``/diagnostics`` at 1 Hz and an orderly end.

    A subclass ends the process by :meth:`finish`; what it must do last (no current, a closed bag)
    it does in :meth:`close`, which runs however the process ends, publishers still working.
    """

    def __init__(self, name: str, parameter_table: type[P], **node_options: Any) -> None:
        super().__init__(name, automatically_declare_parameters_from_overrides=True, **node_options)
        self.parameters: P = ros_parameters.declare(self, parameter_table)
        self.add_on_set_parameters_callback(self._on_set_parameters)
        self.steady_clock = Clock(clock_type=ClockType.STEADY_TIME)
        self._finished: Future = Future()
        self.exit_code: int | None = None
        self._started = time.monotonic()
        self._claims: dict[str, str] = {}
        self._diagnostics = self.create_publisher(DiagnosticArray, DIAGNOSTICS, 10)
        self.create_timer(1.0, self._publish_diagnostics, clock=self.steady_clock)
        if self.parameters.effective_parameters:
            self._write_effective_parameters(Path(self.parameters.effective_parameters))

    def finish(self, exit_code: int = 0) -> None:
        """End the process with this exit code once the running callback returns."""
        if self.exit_code is None:
            self.exit_code = exit_code
            self._finished.set_result(None)

    def fail(self, message: str) -> None:
        """Say what is wrong in one line and end the process with exit code 1."""
        self.get_logger().error(message)
        self.finish(1)

    def close(self) -> None:
        """What must happen last; publishers still work. Must be quick and must not raise."""

    def take_realtime_priority(self) -> None:
        """In real time, put all threads of this process under SCHED_FIFO, where permitted.

        For nodes with :class:`SourceParameters`, when their publishers and subscriptions exist, so
        that the middleware's threads do too.
        """
        parameters: Any = self.parameters
        if parameters.mode != 'realtime' or parameters.realtime_priority == 0:
            return
        try:
            for thread in os.listdir('/proc/self/task'):
                scheduling = os.sched_param(parameters.realtime_priority)
                os.sched_setscheduler(int(thread), os.SCHED_FIFO, scheduling)
        except OSError:
            self.get_logger().warning(
                'real-time priority is not permitted (see ulimit -r): samples may come late'
            )

    def may_stop(self) -> bool:
        """Whether a signal may end the process now; asked again and again until it may.

        A second signal ends it anyhow.
        """
        return True

    def on_parameters(self, parameters: P) -> None:
        """Take new, valid parameters while running. Raises ParameterError to refuse them."""
        raise ParameterError('this node takes no parameters while it runs')

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Level (REP-107), message and values for ``/diagnostics``."""
        return DiagnosticStatus.OK, 'running', {}

    def claim(self, topic: str, what: str) -> None:
        """Be the only publisher of a topic: raise NodeError when another node publishes it.

        Called before the publisher is made; waits until discovery has had :data:`DISCOVERY_TIME`
        since the node came up. On a busy machine discovery can take longer, so the node goes on
        looking for its first seconds, and leaves when it finds another then.
        """
        while time.monotonic() - self._started < DISCOVERY_TIME:
            time.sleep(0.02)
        publishers = self.get_publishers_info_by_topic(topic)
        if publishers:
            raise NodeError(self._taken(topic, what, publishers[0].node_name))
        self._claims[topic] = what
        if len(self._claims) == 1:
            self._probation = self.create_timer(0.25, self._look_again, clock=self.steady_clock)

    def alone(self) -> bool:
        """Whether what was claimed still has one publisher; otherwise the node ends."""
        for topic, what in self._claims.items():
            names = [info.node_name for info in self.get_publishers_info_by_topic(topic)]
            if len(names) > 1:
                self.fail(self._taken(topic, what, names[0]))
                return False
        return True

    def on_probation(self) -> bool:
        """Whether the node is so young that another of its kind may yet be discovered."""
        return time.monotonic() - self._started < _PROBATION

    def _look_again(self) -> None:
        self.alone()
        if not self.on_probation():
            self._probation.cancel()

    @staticmethod
    def _taken(topic: str, what: str, who: str) -> str:
        return (
            f"{topic} is already published by '{who}': there is another {what} on this graph;"
            ' stop it, or use another ROS_DOMAIN_ID'
        )

    def _on_set_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        ours = {p.name: p.value for p in changes if not ros_parameters.is_ros_own(p.name)}
        if not ours:
            return SetParametersResult(successful=True)
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
        status.hardware_id = 'maglev_stage'
        status.values = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _write_effective_parameters(self, path: Path) -> None:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(table.to_yaml(self.parameters, self.get_name()), encoding='utf-8')
        except OSError as error:
            raise NodeError(
                f"cannot write the effective parameters to '{path}': {error}"
            ) from error

    def spin(self, stop: Callable[[], bool]) -> None:
        """Serve the graph until :meth:`finish` or until ``stop()`` holds; every wait is bounded."""
        executor = EventsExecutor()
        executor.add_node(self)
        try:
            while not self._finished.done() and not stop():
                executor.spin_until_future_complete(self._finished, timeout_sec=_SPIN_BOUND)
        finally:
            executor.remove_node(self)
            executor.shutdown()


def run(make_node: Callable[[], MaglevNode[Any]], name: str) -> int:
    """Run one node to its end and return the exit code of the process.

    SIGINT and SIGTERM end it in order: :meth:`MaglevNode.close` runs and can still publish.
    What the user did wrong is one line on stderr; a defect shows its traceback.
    """
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda signum, _frame: caught.append(signum))
    node: MaglevNode[Any] | None = None
    prepare_middleware()
    try:
        rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
        node = make_node()
        gc.collect()
        gc.freeze()
        running = node
        node.spin(lambda: len(caught) > 1 or bool(caught and running.may_stop()))
    except (NodeError, ParameterError) as error:
        print(f'{name}: error: {error}', file=sys.stderr, flush=True)
        return 1
    except Exception as error:
        if not _is_user_error(error):
            raise
        text = str(error).split(', at /')[0].splitlines()[0]
        print(f'{name}: error: {text}', file=sys.stderr, flush=True)
        return 1
    finally:
        _close(node)
    if node.exit_code is not None:
        return node.exit_code
    return 128 + caught[0] if caught else 0


def main(make_node: Callable[[], MaglevNode[Any]], name: str, *, background: bool = False) -> None:
    """Entry point of an executable: run one node and leave with its exit code.

    A node in the background yields to those of the loop when they want the same core.
    Leaves without the interpreter's own teardown, which may block in the middleware.
    """
    if background:
        os.nice(_BACKGROUND_NICENESS)
    try:
        code = run(make_node, name)
    except Exception:
        sys.excepthook(*sys.exc_info())
        code = 70
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _is_user_error(error: Exception) -> bool:
    """Errors ROS raises for what was typed: unknown arguments, unreadable parameter files."""
    return type(error).__module__.startswith(('rclpy', '_rclpy'))


def _close(node: MaglevNode[Any] | None) -> None:
    if node is not None:
        node.close()
        _deliver(node)
        node.destroy_node()
    rclpy.try_shutdown()


def _deliver(node: Node) -> None:
    """Give what was published last, such as currents of zero, the time to arrive."""
    deadline = time.monotonic() + _DELIVERY_TIME
    for publisher in node.publishers:
        left = max(deadline - time.monotonic(), 0.0)
        publisher.wait_for_all_acked(Duration(seconds=left))
