"""Real nodes in processes of their own, over real DDS."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from multiprocessing import forkserver
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from ament_index_python.packages import get_package_prefix
from forked import run_script
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from rclpy.task import Future
from std_srvs.srv import SetBool, Trigger

from maglev_model.contract.wire import record_type
from maglev_node.dds import prepare_middleware
from maglev_node.leaving import stop_receiving
from maglev_node.polling import PolledSubscription, PollingNode
from maglev_node.topics import KEYS, SAMPLE_TOPICS, sampled

ROOT = Path(__file__).resolve().parents[2]
PARAMS = ROOT / 'params'

_IMPORTED_BY_NODES = (
    *('maglev_plant.node', 'maglev_controller.node', 'maglev_reference.node'),
    *('maglev_hw_bridge.node', 'maglev_monitor.live.node', 'maglev_monitor.bag.recorder'),
)
_PACKAGES = {'web': 'maglev_view'} | dict.fromkeys(('recorder', 'watchers'), 'maglev_monitor')
_MATCHING = 0.3  # in which a service has seen a new client, whose answer would else be lost [s]


def executable(package: str, name: str) -> str:
    """Path of an installed executable, which is what ``ros2 run`` runs."""
    return str(Path(get_package_prefix(package)) / 'lib' / package / name)


class Process:
    """One started command; its output is in ``log``."""

    def __init__(self, command: list[str], log: Path) -> None:
        self.log = log
        self._process = self._start(command)
        self.pid = self._process.pid

    def _start(self, command: list[str]) -> Any:
        with self.log.open('wb') as output:
            return subprocess.Popen(
                command, stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )

    def _code(self, timeout: float) -> int | None:
        """Exit code, negative for a signal; None when it has not ended by then."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            return int(self._process.wait(timeout))
        return None

    def wait(self, timeout: float = 30.0) -> int:
        """Exit code, as a shell would give it."""
        code = self._code(timeout)
        assert code is not None, f'it did not end:\n{self.output}'
        return code if code >= 0 else 128 - code

    def signal(self, number: signal.Signals) -> None:
        """Send a signal to the process, if it still runs."""
        if self.running:
            with contextlib.suppress(ProcessLookupError):  # it may have ended since
                os.kill(self.pid, number)

    @property
    def running(self) -> bool:
        """Whether the process has not ended."""
        return self._code(0.0) is None

    @property
    def output(self) -> str:
        """All it printed so far."""
        return self.log.read_text(errors='replace')

    def wait_for(self, text: str, timeout: float = 30.0, unless: str = '') -> None:
        """Wait until it has printed a text; fails when it ends, is late or says ``unless``."""
        deadline = time.monotonic() + timeout
        while text not in self.output:
            assert self.running, f'ended before it said {text!r}:\n{self.output}'
            assert time.monotonic() < deadline, f'never said {text!r}:\n{self.output}'
            assert not unless or unless not in self.output, self.output
            time.sleep(0.02)

    def kill(self) -> None:
        """End it at once, with everything it started."""
        for kill, pid in ((os.killpg, self.pid), (os.kill, self.pid)):
            with contextlib.suppress(ProcessLookupError):
                kill(pid, signal.SIGKILL)
        self._code(10.0)


class ForkedProcess(Process):
    """A Python script run in a copy of a process that has imported what all nodes do."""

    def _start(self, command: list[str]) -> Any:
        started = _forks().Process(
            target=run_script, args=(command, dict(os.environ), os.getcwd(), str(self.log))
        )
        self.log.touch()
        started.start()
        return started

    def _code(self, timeout: float) -> int | None:
        self._process.join(timeout)
        code: int | None = self._process.exitcode
        return code


@cache
def _forks() -> Any:
    """A server that starts processes; it has one thread, as what forks must."""
    context = multiprocessing.get_context('forkserver')
    context.set_forkserver_preload(['compiled_ahead', *_IMPORTED_BY_NODES, 'ready'])
    given = os.environ.get('PYTHONPATH', '')
    os.environ['PYTHONPATH'] = f'{ROOT / "test" / "support"}:{given}'  # or it would not find ours
    forkserver.ensure_running()
    os.environ['PYTHONPATH'] = given
    return context


class Nodes:
    """Starts nodes by name; whatever still runs at the end of a test is killed."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.started: list[Process] = []

    def start(
        self,
        name: str,
        *arguments: str,
        params: tuple[str | Path, ...] = (),
        remap: tuple[str, ...] = (),
        on: Sequence[str] = (),
    ) -> Process:
        """Start ``plant``, ``controller``, … with parameters ``name:=value``, files, remappings.

        ``on`` is what the command begins with that starts it on another host.
        """
        package = _PACKAGES.get(name, f'maglev_{name}')
        command = [*on, executable(package, name), '--ros-args']
        for file in params:
            path = PARAMS / file if (PARAMS / file).exists() else Path(file)
            command += ['--params-file', str(path)]
        for argument in arguments:
            command += ['-p', argument]
        for rule in remap:
            command += ['-r', rule]
        return self._add(Process if on else ForkedProcess, name, command)

    def run(self, name: str, command: list[str]) -> Process:
        """Start any command."""
        return self._add(Process, name, command)

    def _add(self, kind: type[Process], name: str, command: list[str]) -> Process:
        process = kind(command, self.folder / f'{name}-{len(self.started)}.log')
        self.started.append(process)
        return process


class Heard(Sequence[Any]):
    """Messages of a topic as they came; each is decoded when somebody looks at it."""

    def __init__(self, topic: str) -> None:
        self._kind, self._key = SAMPLE_TOPICS[sampled(topic)], KEYS[sampled(topic)]
        self._held: list[bytes] = []
        self._decoded: dict[int, Any] = {}

    def add(self, taken: Iterable[bytes]) -> None:
        """Keep more."""
        self._held.extend(taken)

    def __len__(self) -> int:
        return len(self._held)

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        index = range(len(self))[index]
        if index not in self._decoded:
            self._decoded[index] = deserialize_message(self._held[index], self._kind)
        return self._decoded[index]

    def every(self, field: str) -> np.ndarray:
        """One field of all messages, which are of one sender."""
        layout = record_type(self._key, self._held[0])
        return np.frombuffer(b''.join(self._held), layout)[field]


class Observer:
    """A node of the test's own that keeps every message of the sample topics it watches."""

    def __init__(self, namespace: str = '', remap: tuple[str, ...] = ()) -> None:
        prepare_middleware()
        self._context = rclpy.Context()
        self._context.init()
        rules = [word for rule in remap for word in ('-r', rule)]
        self.node = PollingNode(
            'observer',
            context=self._context,
            namespace=namespace,
            cli_args=['--ros-args', *rules],
        )
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._subscriptions: dict[str, PolledSubscription] = {}
        self.messages: dict[str, Heard] = {}
        self._clients: dict[str, Any] = {}
        self._heard: list[Any] = []

    def watch(self, *topics: str) -> None:
        """Keep the messages of these topics from now on."""
        for topic in topics:
            self.messages[topic] = Heard(topic)
            kind = SAMPLE_TOPICS[sampled(topic)]
            self._subscriptions[topic] = self.node.poll(topic, kind, raw=True)

    def look(self) -> dict[str, Heard]:
        """All messages so far, by topic."""
        for topic, subscription in self._subscriptions.items():
            self.messages[topic].add(message for message, _ in subscription.take())
        return self.messages

    def newest(self, topic: str) -> Any:
        """The newest message of a topic, None before the first."""
        messages = self.look()[topic]
        return messages[-1] if messages else None

    def wait(self, condition: Callable[[], bool], timeout: float = 60.0) -> None:
        """Look until something holds."""
        deadline = time.monotonic() + timeout
        while not condition():
            assert time.monotonic() < deadline, 'it never held'
            self.look()
            time.sleep(0.01)

    def call(self, service: str, data: bool | None = None) -> Any:
        """Call a Trigger service, or with ``data`` a SetBool service."""
        service_type = Trigger if data is None else SetBool
        request = service_type.Request()
        if data is not None:
            request.data = data
        return self.ask(self._client(service_type, service), request)

    def _client(self, service_type: Any, service: str) -> Any:
        """One for all calls of a service: a new one is not heard at once."""
        if service not in self._clients:
            self._clients[service] = self.node.create_client(service_type, service)
        return self._clients[service]

    def ask(self, client: Any, request: Any, timeout: float = 20.0) -> Any:
        """The answer of any service."""
        future = self.begin_to_ask(client, request, timeout)
        self._executor.spin_until_future_complete(future, timeout_sec=timeout)
        assert future.done(), f'{client.srv_name} never answered'
        return future.result()

    def begin_to_ask(self, client: Any, request: Any, timeout: float = 20.0) -> Any:
        """The future answer of any service."""
        self.make_heard(client, timeout)
        return client.call_async(request)

    def make_heard(self, client: Any, timeout: float = 20.0) -> None:
        """Wait until a service is there, and would hear the client."""
        assert client.wait_for_service(timeout_sec=timeout), f'there is no {client.srv_name}'
        if client not in self._heard:  # there for us, but are we there for it?
            self._heard.append(client)
            self.serve(_MATCHING)

    def serve(self, duration: float) -> None:
        """Let callbacks of the test's own run."""
        self._executor.spin_until_future_complete(Future(), timeout_sec=duration)

    def set_parameters(self, node: str, **values: Any) -> Any:
        """Set parameters of a node all at once; ``__`` in a name stands for a dot."""
        return self.answer(self.begin_to_set(node, **values)).result

    def answer(self, future: Any, timeout: float = 60.0) -> Any:
        """What a future holds in the end."""
        self._executor.spin_until_future_complete(future, timeout_sec=timeout)
        assert future.done(), 'it was never answered'
        return future.result()

    def begin_to_set(self, node: str, **values: Any) -> Any:
        """As :meth:`set_parameters`, but only the future answer."""
        client = self._client(SetParametersAtomically, f'/{node}/set_parameters_atomically')
        request = SetParametersAtomically.Request()
        request.parameters = [
            Parameter(name.replace('__', '.'), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
        return self.begin_to_ask(client, request)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        stop_receiving()
        self.node.destroy_node()
        self._context.try_shutdown()
