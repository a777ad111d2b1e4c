"""While gains are designed the controller's node serves by hand what must not wait."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator

import pytest
import rclpy
from graph import Nodes, Observer
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from maglev_controller.node import ControllerNode
from maglev_controller.parameters import ControllerParameters
from maglev_model.contract.modes import Mode
from maglev_model.parameters import ParameterError, replace
from maglev_msgs.msg import Measurement
from maglev_node.topics import MEASUREMENT, sample_qos


@pytest.fixture
def controller(monkeypatch: pytest.MonkeyPatch) -> Iterator[ControllerNode]:
    """The node, in this process."""
    monkeypatch.setattr('sys.argv', ['controller'])
    rclpy.init(args=[])
    node = ControllerNode()
    yield node
    node.destroy_node()
    rclpy.try_shutdown()


class EndlessDesign:
    """A design that ends when the supervisor is in a fault."""

    def __init__(self, node: ControllerNode) -> None:
        self._node = node
        self._begun = time.monotonic()
        self.ended = False

    @property
    def done(self) -> bool:
        late = time.monotonic() > self._begun + 30.0
        return self.ended or late or self._node.supervisor.mode == Mode.FAULT

    def end(self) -> None:
        self.ended = True

    def result(self) -> None:
        raise ParameterError('it was ended' if self.ended else 'it ended')


@pytest.fixture
def endless(controller: ControllerNode, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every design of the node lasts until somebody stops it."""

    def redesign(_parameters: ControllerParameters) -> EndlessDesign:
        return EndlessDesign(controller)

    monkeypatch.setattr(controller.supervisor, 'redesign', redesign)


@pytest.mark.usefixtures('endless')
def test_an_emergency_stop_does_not_wait_for_a_design(
    controller: ControllerNode, observer: Observer
) -> None:
    client = observer.node.create_client(Trigger, '/controller/emergency_stop')
    asked = observer.begin_to_ask(client, Trigger.Request())
    with pytest.raises(ParameterError, match='it ended'):
        controller.on_parameters(replace(controller.parameters, {'y.bandwidth': 180.0}))
    assert controller.supervisor.reason == 'emergency stop'
    observer.wait(lambda: observer.serve(0.01) is None and asked.done())
    assert asked.result().success
    # What was served by hand does not disturb the executor, which is told of it afterwards.
    client = observer.node.create_client(Trigger, '/controller/reset')
    asked = observer.begin_to_ask(client, Trigger.Request())
    end = time.monotonic() + 30.0
    controller.spin(lambda: controller.supervisor.mode == Mode.DISABLED or time.monotonic() > end)
    observer.wait(lambda: observer.serve(0.01) is None and asked.done())
    assert asked.result().message == 'cleared: emergency stop'


@pytest.mark.usefixtures('endless')
def test_nor_for_a_stage_that_is_never_out_of_measurements(
    controller: ControllerNode, observer: Observer, monkeypatch: pytest.MonkeyPatch
) -> None:
    publisher = observer.node.create_publisher(Measurement, MEASUREMENT, sample_qos())
    end = time.monotonic() + 10.0

    def answer(_message: bytes) -> None:
        if time.monotonic() < end:
            publisher.publish(Measurement())
            time.sleep(0.005)  # in which it arrives

    monkeypatch.setattr(controller._measurements, 'callback', answer)
    observer.wait(lambda: publisher.get_subscription_count() > 0)
    client = observer.node.create_client(Trigger, '/controller/emergency_stop')
    observer.begin_to_ask(client, Trigger.Request())
    answer(b'')
    with pytest.raises(ParameterError, match='it ended'):
        controller.on_parameters(replace(controller.parameters, {'y.bandwidth': 180.0}))
    assert controller.supervisor.reason == 'emergency stop'
    assert time.monotonic() < end, 'it was served only when no more measurements came'


@pytest.mark.usefixtures('endless')
def test_a_node_that_is_told_to_end_designs_nothing(controller: ControllerNode) -> None:
    told = iter([False, False])  # before the design, and when it has begun
    controller.ending = lambda: next(told, True)
    tuned = [Parameter('y.bandwidth', value=180.0)]
    assert controller.set_parameters_atomically(tuned).reason == 'it was ended'
    assert controller.set_parameters_atomically(tuned).reason == 'the node is told to end'


def test_a_signal_does_not_wait_for_all_that_is_to_be_set(nodes: Nodes, observer: Observer) -> None:
    process = nodes.start('controller')
    process.wait_for('waiting for')
    asked = [
        observer.begin_to_set('controller', y__bandwidth=100.0 + number) for number in range(40)
    ]
    observer.answer(asked[0])
    os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C, which reaches the design's process too
    assert process.wait() == 0
    observer.serve(0.2)
    assert sum(each.done() and each.result().result.successful for each in asked) < 20
    assert 'Traceback' not in process.output
