"""The bridge as a node: the same contract as the plant's, managed, and faults on a real graph."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from flight import BRISK, ELLIPSE, LOWER_STOP, SWIFT, samples
from graph import PARAMS, Nodes, Observer, Process
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from std_srvs.srv import Trigger

from maglev_msgs.msg import ControllerState, Currents
from maglev_node.topics import (
    CONTROLLER_STATE,
    CURRENTS,
    MEASUREMENT,
    REFERENCE,
    TRUE_STATE,
    sample_qos,
)

FILES = {'plant': ('benchmark.yaml',), 'hw_bridge': ('hw_bridge.yaml',)}


class Life:
    """The life-cycle services of a node, and what it says on /diagnostics."""

    def __init__(self, observer: Observer, name: str) -> None:
        self._observer, self._name = observer, name
        node = observer.node
        self._change = node.create_client(ChangeState, f'/{name}/change_state')
        self._get = node.create_client(GetState, f'/{name}/get_state')
        self._said: list[DiagnosticStatus] = []
        node.create_subscription(DiagnosticArray, '/diagnostics', self._hear, 10)

    def _hear(self, message: DiagnosticArray) -> None:
        self._said += [status for status in message.status if status.name == self._name]

    def change(self, transition: int) -> bool:
        request = ChangeState.Request()
        request.transition.id = transition
        return bool(self._observer.ask(self._change, request).success)

    @property
    def state(self) -> str:
        return str(self._observer.ask(self._get, GetState.Request()).current_state.label)

    def newest(self) -> DiagnosticStatus | None:
        self._observer.serve(0.02)
        return self._said[-1] if self._said else None

    def fault(self) -> str:
        status = self.newest()
        return status.message if status and status.level == DiagnosticStatus.ERROR else ''


def numbers(observer: Observer) -> list[int]:
    return [message.sequence for message in observer.look()[MEASUREMENT]]


def height(observer: Observer) -> float:
    newest = observer.newest(MEASUREMENT)
    return LOWER_STOP if newest is None else float(np.mean(newest.gap))


def answer(observer: Observer) -> Callable[..., None]:
    """A controller of the test's own, that wants the same direct current [A] of every motor."""
    publisher = observer.node.create_publisher(Currents, CURRENTS, sample_qos())
    answered = 0

    def publish(sequence: int, current: float = 0.0) -> None:
        nonlocal answered
        measured = observer.messages[MEASUREMENT]
        if len(measured) == answered:  # nothing new, not even a sample that is repeated
            return
        answered = len(measured)
        header = next(m.header for m in measured if m.sequence == sequence)
        message = Currents(header=header, sequence=sequence, session=1)
        message.direct_current = [current] * 4
        message.status = Currents.FLYING if current else Currents.RESTING
        publisher.publish(message)

    return publish


@pytest.mark.parametrize('stage', ['plant', 'hw_bridge'])
def test_lockstep_as_every_stage(stage: str, nodes: Nodes, observer: Observer) -> None:
    process = nodes.start(stage, 'first_sequence:=7', params=FILES[stage])
    observer.watch(MEASUREMENT)
    observer.wait(lambda: len(numbers(observer)) > 3)
    assert set(numbers(observer)) == {7}
    publish = answer(observer)
    while (newest := max(numbers(observer))) < 30:
        publish(newest)
        observer.serve(0.01)
    seen = numbers(observer)
    assert sorted(set(seen)) == list(range(7, 31))
    assert seen == sorted(seen)
    process.signal(signal.SIGTERM)
    assert process.wait() == 0


@pytest.mark.parametrize('stage', ['plant', 'hw_bridge'])
def test_currents_are_followed_once_they_have_been_zero(
    stage: str, nodes: Nodes, observer: Observer
) -> None:
    nodes.start(stage, params=FILES[stage])
    observer.watch(MEASUREMENT)
    observer.wait(lambda: bool(numbers(observer)))
    publish = answer(observer)

    def lifts_with(current: float, samples: int) -> bool:
        end = max(numbers(observer)) + samples
        while (newest := max(numbers(observer))) < end:
            publish(newest, current)
            observer.serve(0.002)
        return height(observer) < LOWER_STOP - 5e-5

    lifting = -5.0
    assert not lifts_with(
        lifting, 60
    )  # a controller that flies already when the stage is activated
    assert observer.call(f'/{stage}/emergency_stop').success
    assert not lifts_with(lifting, 5)
    assert observer.call(f'/{stage}/reset').success
    assert not lifts_with(lifting, 60)  # or that went on flying all the time
    assert not lifts_with(0.0, 2)
    assert lifts_with(lifting, 60)


@pytest.mark.parametrize('stage', ['plant', 'hw_bridge'])
def test_a_managed_node(stage: str, nodes: Nodes, observer: Observer) -> None:
    process = nodes.start(stage, 'autostart:=false', params=FILES[stage])
    observer.watch(MEASUREMENT)
    life = Life(observer, stage)
    assert life.state == 'unconfigured'
    process.wait_for(f'waiting for ros2 lifecycle set /{stage} configure, ')
    assert life.change(Transition.TRANSITION_CONFIGURE)
    assert life.state == 'inactive'
    assert numbers(observer) == []
    assert life.change(Transition.TRANSITION_ACTIVATE)
    for unknown in (Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CONFIGURE, 200):
        assert not life.change(unknown)
    process.wait_for("transition '3' refused: active, from where there are deactivate (4)")
    observer.wait(lambda: bool(numbers(observer)))
    assert life.change(Transition.TRANSITION_DEACTIVATE)
    assert life.state == 'inactive'
    assert life.change(Transition.TRANSITION_ACTIVATE)
    assert life.change(Transition.TRANSITION_DEACTIVATE)
    assert life.change(Transition.TRANSITION_CLEANUP)
    assert life.state == 'unconfigured'
    assert life.change(Transition.TRANSITION_CONFIGURE)
    assert life.change(Transition.TRANSITION_INACTIVE_SHUTDOWN)
    assert process.wait() == 0, process.output


def test_unhomed_it_is_not_activated(nodes: Nodes, observer: Observer) -> None:
    process = nodes.start('hw_bridge', 'autostart:=false', 'homing.x:=0.0', 'homing.z:=0.0')
    life = Life(observer, 'hw_bridge')
    assert not observer.call('/hw_bridge/home').success
    assert 'service call /hw_bridge/home' in process.output  # it says what it waits for
    assert life.change(Transition.TRANSITION_CONFIGURE)
    assert not life.change(Transition.TRANSITION_ACTIVATE)
    assert 'home first' in process.output
    assert life.state == 'inactive'
    assert observer.call('/hw_bridge/home').success
    assert life.change(Transition.TRANSITION_ACTIVATE)


@pytest.mark.parametrize(
    ('arguments', 'text'),
    [
        (['driver:=quanser', 'mode:=realtime'], 'quanser.com'),
        (['driver:=quanser'], 'realtime'),
        (['driver:=oscilloscope'], 'one of emulated, quanser'),
        (['boards.watchdogg:=0.02'], "did you mean 'boards.watchdog'"),
        (['boards.watchdog:=20.0'], 'must lie in'),
    ],
)
def test_bad_parameters_are_one_clear_line(arguments: list[str], text: str, nodes: Nodes) -> None:
    process = nodes.start('hw_bridge', *arguments, params=FILES['hw_bridge'])
    assert process.wait() == 1
    assert text in process.output
    assert 'Traceback' not in process.output


def fly(
    nodes: Nodes,
    observer: Observer,
    *arguments: str,
    mode: str = 'lockstep',
    stage: Process | None = None,
) -> dict[str, Process]:
    """Bridge, controller and reference on the ellipse, until it is airborne."""
    observer.watch(MEASUREMENT, REFERENCE, CURRENTS, CONTROLLER_STATE, TRUE_STATE)
    common = f'mode:={mode}', 'watchers:=[observer]'  # by the test
    graph = {
        'stage': stage
        or nodes.start('hw_bridge', *common, *SWIFT, *arguments, params=FILES['hw_bridge']),
        'controller': nodes.start('controller', *common, *SWIFT),
        'reference': nodes.start(
            *('reference', *common, 'duration:=600.0', *BRISK), params=(ELLIPSE,)
        ),
    }
    lost = 'left the run'
    observer.wait(lambda: height(observer) < 0.026 or lost in graph['reference'].output)
    assert lost not in graph['reference'].output
    return graph


def test_a_dead_controller(nodes: Nodes, observer: Observer) -> None:
    graph = fly(nodes, observer, 'answer_timeout:=2.0')
    life = Life(observer, 'hw_bridge')
    graph['controller'].kill()
    observer.wait(lambda: height(observer) > LOWER_STOP - 1e-5)
    observer.wait(lambda: 'no fresh currents' in life.fault())
    assert graph['stage'].running
    assert graph['stage'].output.count('fault at sample') == 1
    assert observer.call('/hw_bridge/reset').success
    assert not observer.call('/hw_bridge/reset').success
    graph['stage'].signal(signal.SIGINT)
    assert graph['stage'].wait() == 0


@pytest.mark.alone
@pytest.mark.real_time
def test_in_real_time_emulated_boards_bear_a_desktop(nodes: Nodes, observer: Observer) -> None:
    graph = fly(nodes, observer, mode='realtime')
    before = observer.newest(MEASUREMENT).sequence
    graph['stage'].signal(signal.SIGSTOP)
    time.sleep(0.1)  # far longer than the boards' watchdog
    graph['stage'].signal(signal.SIGCONT)
    observer.wait(lambda: observer.newest(MEASUREMENT).sequence > before + 1000)
    assert observer.newest(CONTROLLER_STATE).mode == ControllerState.REGULATING
    assert 'fault' not in graph['stage'].output


def test_an_emergency_stop_lands_and_stays(nodes: Nodes, observer: Observer) -> None:
    graph = fly(nodes, observer)
    life = Life(observer, 'hw_bridge')
    assert observer.call('/hw_bridge/emergency_stop').success
    observer.wait(lambda: height(observer) > LOWER_STOP - 1e-5)
    observer.wait(lambda: 'emergency stop' in life.fault())
    graph['reference'].kill()
    observer.wait(lambda: observer.call('/hw_bridge/reset').success)
    ended = ControllerState.DISABLED, ControllerState.FAULT  # where samples passed it by
    observer.wait(lambda: observer.newest(CONTROLLER_STATE).mode in ended)
    samples(observer, 200)
    assert np.min(np.mean(observer.messages[MEASUREMENT].every('gap')[-200:], axis=1)) > (
        LOWER_STOP - 1e-5
    )


def test_deactivated_in_flight_it_lands_first(nodes: Nodes, observer: Observer) -> None:
    graph = fly(nodes, observer)
    life = Life(observer, 'hw_bridge')
    assert life.change(Transition.TRANSITION_DEACTIVATE)
    observer.wait(lambda: height(observer) > LOWER_STOP - 1e-5)
    assert landed_softly(observer)
    assert 'fault' not in graph['stage'].output


def landed_softly(observer: Observer) -> bool:
    gaps = np.mean(observer.messages[MEASUREMENT].every('gap'), axis=1)
    return bool(np.max(np.abs(np.diff(gaps[-2000:]))) < 5e-5)  # 0.05 m/s


@pytest.mark.parametrize(
    'signals',
    [
        pytest.param((signal.SIGINT,), marks=pytest.mark.long),
        pytest.param((signal.SIGHUP,), marks=pytest.mark.long),
        pytest.param((signal.SIGINT, signal.SIGINT), marks=pytest.mark.long),
        (signal.SIGINT, signal.SIGTERM),
        (signal.SIGTSTP,),
        (signal.SIGQUIT,),
    ],
)
def test_stopped_in_flight_it_lands_first(
    signals: tuple[signal.Signals, ...], nodes: Nodes, observer: Observer
) -> None:
    graph = fly(nodes, observer)
    for number in signals:
        graph['stage'].signal(number)
        time.sleep(0.01)
    assert graph['stage'].wait() == 0
    observer.wait(lambda: height(observer) > LOWER_STOP - 1e-5)
    assert landed_softly(observer)


BREAKING = """
from maglev_hw_bridge.node import BridgeNode
from maglev_node.executable import run_nodes

class Breaking(BridgeNode):
    def __init__(self):
        super().__init__()
        self.offer('~/break', self._break)

    def _break(self):
        raise RuntimeError('a defect')

run_nodes('hw_bridge', Breaking)
"""


def test_a_callback_that_raises_lands_it(nodes: Nodes, observer: Observer) -> None:
    file = str(PARAMS / 'hw_bridge.yaml')
    arguments = ['--ros-args', '--params-file', file, '-p', 'watchers:=[observer]']
    program = [sys.executable, '-c', BREAKING, *arguments]
    graph = fly(nodes, observer, stage=nodes.run('hw_bridge', program))
    client = observer.node.create_client(Trigger, '/hw_bridge/break')
    observer.wait(client.service_is_ready)
    client.call_async(Trigger.Request())
    assert graph['stage'].wait() == 70
    assert 'a defect' in graph['stage'].output
    observer.wait(lambda: height(observer) > LOWER_STOP - 1e-5)
    assert landed_softly(observer)


def test_asked_to_land_it_says_what_it_does(nodes: Nodes, observer: Observer) -> None:
    lost_at = ('emulation.inject.expired_watchdog:=true', 'emulation.inject.sample:=20')
    nodes.start('hw_bridge', *lost_at, params=FILES['hw_bridge'])
    observer.watch(MEASUREMENT)
    observer.wait(lambda: bool(numbers(observer)))
    resting = 'no current, amplifiers disabled; ~/reset follows the controller again'
    for _ in range(2):
        landed = observer.call('/hw_bridge/land')
        assert (landed.success, landed.message) == (True, resting)
    publish = answer(observer)

    def lost() -> bool:
        publish(max(numbers(observer)))
        return 'watchdog' in observer.call('/hw_bridge/land').message

    observer.wait(lost)
    refused = observer.call('/hw_bridge/land')
    assert not refused.success
    assert refused.message.startswith("no current flows: the boards' watchdog expired")
