"""The loop of real nodes: it flies, it lands, and it ends well however it is disturbed."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from flight import (
    LONG,
    LOWER_STOP,
    airborne,
    fly,
    gap,
    idles,
    impact_speed,
    landed_without_current,
    samples,
    starts,
)
from graph import Nodes, Observer, Process

from maglev_msgs.msg import ControllerState, Measurement, Reference
from maglev_node.topics import (
    CONTROLLER_PROGRESS,
    CONTROLLER_STATE,
    DIAGNOSTICS,
    MEASUREMENT,
    PROGRESS,
    PROGRESS_PERIOD,
    REFERENCE,
    SAMPLE_TOPICS,
    SILENCE,
    STAGE_PROGRESS,
    reference_qos,
    sample_qos,
)

STRANGER = Path(__file__).resolve().parents[1] / 'support' / 'stranger.py'


def errors_on_time(observer: Observer, first: int) -> np.ndarray:
    """Errors in y, x, z (n, 3) [m] since a sample, half a second after a standstill left out.

    Of the test machine, that is: of 20 samples in a row 10 and more are late then.
    """
    topics = observer.look()
    late_samples = {m.sequence: m.late_samples for m in topics[MEASUREMENT]}
    flown = [m for m in topics[CONTROLLER_STATE] if first < m.sequence <= max(late_samples)]
    assert all(message.mode == ControllerState.REGULATING for message in flown)
    late = np.array([late_samples[message.sequence] for message in flown])
    standstill = np.r_[np.zeros(20), late[20:] - late[:-20] >= 10]
    on_time = np.convolve(standstill, np.ones(500))[: len(late)] == 0
    assert np.mean(on_time) > 0.5
    return np.array([message.error[:3] for message in flown])[on_time]


def in_part(messages: Sequence[Any], steady: Callable[[Any], bool]) -> list[int]:
    """The samples of which those tell on a topic of progress."""
    return [
        message.sequence
        for before, message in pairwise([None, *messages])
        if before is None
        or not (steady(before) and steady(message))
        or message.sequence % PROGRESS_PERIOD == 0
    ]


def test_lift_off_ellipse_landing(nodes: Nodes, watching: Observer) -> None:
    watching.watch(*PROGRESS)
    graph = fly(nodes, 'duration:=1.0', 'exit_at_end:=true')
    watching.wait(lambda: not graph['reference'].running, timeout=60)
    assert graph['reference'].wait() == 0, graph['reference'].output
    watching.wait(lambda: landed_without_current(watching))
    assert impact_speed(watching) < 0.05
    for topic in SAMPLE_TOPICS:
        messages = watching.look()[topic]
        numbers = [message.sequence for message in messages]
        numbers = numbers[numbers.count(0) - 1 :]  # sample 0 is repeated until it is answered
        assert numbers == list(range(len(numbers))), f'{topic} lost or repeated samples'
    states = watching.messages[CONTROLLER_STATE]
    modes = [message.mode for message in states]
    for topic, messages, steady in (
        (STAGE_PROGRESS, watching.look()[MEASUREMENT], lambda m: m.controller != 0),
        (CONTROLLER_PROGRESS, states, lambda m: m.mode == ControllerState.REGULATING),
    ):
        due = in_part(messages, steady)
        told, newest = watching.messages[topic], messages[-1].sequence
        numbers = [m.sequence for m in told if m.sequence <= newest]  # one may lead
        assert set(numbers) <= set(due)
        assert len(numbers) > 0.2 * len(due)  # of which only the newest is sure to come
        assert len(numbers) < 0.5 * len(modes)
    assert ControllerState.FAULT not in modes
    assert ControllerState.LANDING not in modes
    samples(watching, 10)
    watching.wait(lambda: idles(watching), timeout=10.0)  # with the reference gone


def test_a_controller_is_waited_for_and_lands_without_its_reference(
    nodes: Nodes, watching: Observer
) -> None:
    plant, controller, reference = starts(nodes, LONG, watched=())
    graph = {'plant': plant(), 'reference': reference()}
    graph['reference'].wait_for('starting at sample 0')
    watching.serve(0.5)
    assert {message.phase for message in watching.look()[REFERENCE]} == {Reference.REST}
    graph['controller'] = controller()
    watching.wait(lambda: airborne(watching))

    graph['reference'].kill()
    watching.wait(lambda: landed_without_current(watching))
    assert impact_speed(watching) < 0.05
    assert 'the reference stopped' in graph['controller'].output
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.DISABLED)
    watching.wait(lambda: idles(watching), timeout=10.0)
    answer = watching.call('/controller/enable', True)
    assert answer.success
    watching.wait(lambda: idles(watching), timeout=10.0)


def test_a_stage_that_is_gone_is_told_of(nodes: Nodes, watching: Observer) -> None:
    diagnostics = watching.node.poll(DIAGNOSTICS, DiagnosticArray)
    graph = fly(nodes, LONG)
    watching.wait(lambda: airborne(watching))
    diagnostics.take()
    graph['plant'].kill()
    told: dict[str, str] = {}

    def both() -> bool:
        for message, _ in diagnostics.take():
            told.update((one.name, one.message) for one in message.status if one.level == b'\x01')
        return all(
            'no measurement for' in told.get(node, '') for node in ('controller', 'reference')
        )

    watching.wait(both, timeout=20.0)


def test_nothing_hurries_before_there_is_a_reference(nodes: Nodes, watching: Observer) -> None:
    nodes.start('plant')
    nodes.start('controller', 'enabled:=false')
    watching.wait(lambda: watching.newest(CONTROLLER_STATE) is not None)
    assert idles(watching)
    assert watching.call('/controller/enable', True).success
    assert idles(watching)
    nodes.start('reference', 'lift_off.time:=0.2')
    watching.wait(lambda: airborne(watching))


def test_all_that_a_flight_bears(nodes: Nodes, watching: Observer) -> None:
    """Second nodes, new parameters, a landing and another lift-off, the controller's end."""
    graph = fly(nodes, LONG)
    watching.wait(lambda: airborne(watching))
    for second in [nodes.start(name) for name in graph]:
        assert second.wait() == 1
        assert 'there is another' in second.output
    assert all(process.running for process in graph.values())

    retune(graph, watching, bound=50e-6)

    assert watching.call('/controller/enable', False).success
    watching.wait(lambda: landed_without_current(watching))
    assert impact_speed(watching) < 0.05
    assert 'left the run at sample' in graph['reference'].output
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.DISABLED)
    assert watching.call('/controller/enable', True).success
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.REGULATING)

    graph['controller'].signal(signal.SIGTERM)
    watching.wait(lambda: not graph['controller'].running)
    assert graph['controller'].wait() == 0
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.DISABLED)
    assert impact_speed(watching) < 0.05
    assert gap(watching) == pytest.approx(LOWER_STOP, abs=1e-5)


def lift_off_of_age(graph: dict[str, Process], watching: Observer) -> None:
    """Be in the air with nodes that are there for five seconds, most of which they rest."""
    graph['reference'].wait_for('resting until ~/lift_off')
    time.sleep(5.0)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))


def test_in_flight_one_reference_is_followed(nodes: Nodes, watching: Observer) -> None:
    """One that comes later speaks further ahead, of another place, and with numbers of its own."""
    graph = fly(nodes, LONG, 'autostart:=false')
    lift_off_of_age(graph, watching)  # while it is young, a reference leaves where there is another
    second = watching.node.create_publisher(Reference, REFERENCE, reference_qos())
    stray = Reference(phase=Reference.HOLD, position=[0.02, 0.02, 0.0, 0.0, 0.0], session=7)
    begin = watching.newest(MEASUREMENT).sequence
    while 'another reference is not followed' not in graph['controller'].output:
        stray.sequence = watching.newest(MEASUREMENT).sequence + 100
        second.publish(stray)
        assert stray.sequence < begin + 20_000
        time.sleep(1e-3)
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).sequence > begin + 500)
    flown = [m for m in watching.look()[CONTROLLER_STATE] if m.sequence > begin]
    assert {message.mode for message in flown} == {ControllerState.REGULATING}
    assert np.max(np.abs([message.error[:3] for message in flown])) < 50e-6
    watching.node.destroy_publisher(second)


def test_what_a_second_stage_repeats_does_not_stop_the_flight(
    nodes: Nodes, watching: Observer
) -> None:
    """For a reference that looks seldom it covers all the stage measures, longer than a silence."""
    graph = fly(nodes, LONG, 'autostart:=false', 'poll_period:=0.05')
    lift_off_of_age(graph, watching)  # while it is young, a stage leaves where there is another
    seconds = [
        watching.node.create_publisher(Measurement, topic, sample_qos())
        for topic in (MEASUREMENT, STAGE_PROGRESS)
    ]
    gap = [LOWER_STOP] * 4
    end = time.monotonic() + 2.0 * SILENCE['lockstep']
    while time.monotonic() < end:
        for second in seconds:
            second.publish(Measurement(sequence=0, gap=gap, lockstep=True))
        time.sleep(0.01)
    for second in seconds:
        watching.node.destroy_publisher(second)
    watching.serve(0.5)
    begin = max(message.sequence for message in watching.look()[MEASUREMENT])
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).sequence > begin + 500, timeout=5.0)
    flown = [m for m in watching.look()[CONTROLLER_STATE] if m.sequence > begin]
    assert {message.mode for message in flown} == {ControllerState.REGULATING}
    assert 'began anew' not in graph['controller'].output


def page_faults(graph: dict[str, Process]) -> np.ndarray:
    """How many each of them has had."""
    stats = [Path(f'/proc/{process.pid}/stat').read_text() for process in graph.values()]
    return np.array([int(stat.rpartition(')')[2].split()[7]) for stat in stats])


@pytest.mark.alone
@pytest.mark.real_time
def test_real_time_also_when_a_process_was_stopped(nodes: Nodes, watching: Observer) -> None:
    """One of the graph's own for a while; and for all of the flight somebody else's subscriber."""
    stranger = nodes.run('stranger', [sys.executable, str(STRANGER)])
    graph = fly(nodes, LONG, mode='realtime')
    stranger.wait_for(f'hears {CONTROLLER_STATE}')
    stranger.signal(signal.SIGSTOP)
    watching.wait(lambda: watching.newest(REFERENCE) is not None)
    watching.wait(lambda: watching.newest(REFERENCE).phase == Reference.TRACK)
    first = watching.newest(MEASUREMENT)
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).sequence > first.sequence + 2000)
    assert np.max(np.abs(errors_on_time(watching, first.sequence))) < 100e-6
    newest = watching.newest(MEASUREMENT)
    wall = (newest.wall_time - first.wall_time) * 1e-9
    assert wall == pytest.approx((newest.sequence - first.sequence) * 1e-3, abs=0.1)
    for name, stop in (('plant', 0.1), ('controller', 0.02)):
        before = watching.newest(MEASUREMENT)
        graph[name].signal(signal.SIGSTOP)
        time.sleep(stop)
        graph[name].signal(signal.SIGCONT)
        end = before.sequence + 2000
        watching.wait(lambda end=end: watching.newest(MEASUREMENT).sequence > end)
        after = watching.newest(CONTROLLER_STATE).sequence - 1000
        errors = [m.error[:3] for m in watching.look()[CONTROLLER_STATE] if m.sequence > after]
        assert np.max(np.mean(np.abs(errors), axis=0)) < 100e-6
        assert watching.newest(CONTROLLER_STATE).mode == ControllerState.REGULATING
        assert watching.newest(MEASUREMENT).late_samples >= before.late_samples + 10
        assert 'currents cut' not in graph['plant'].output

    faults = page_faults(graph)
    samples(watching, 1000)
    assert np.max(page_faults(graph) - faults) < 2000  # two a sample


def retune(graph: dict[str, Process], watching: Observer, bound: float) -> None:
    """Change parameters in flight: checked, and felt by no more than an error of ``bound`` [m]."""
    watching.wait(lambda: watching.newest(REFERENCE).phase == Reference.TRACK)
    for refused, said in (
        ({'x__bandwidth': 1e30}, 'bandwidth'),
        ({'machine__mass_y': 7.5}, 'mass_y'),
        ({'y__bandwidth': 'much'}, 'type'),
        ({'enabled': False}, 'read-only'),
    ):
        answer = watching.set_parameters('controller', **refused)
        assert not answer.successful
        assert said in answer.reason
    done = watching.set_parameters('controller', y__bandwidth=180.0, x__bandwidth=180.0)
    assert done.successful, done.reason
    after = watching.newest(CONTROLLER_STATE).sequence + 1000
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).sequence > after)
    tracking = [
        message
        for message in watching.look()[CONTROLLER_STATE]
        if message.sequence > after - 3000 and message.mode == ControllerState.REGULATING
    ]
    assert tracking[-1].sequence > after - 5, graph['controller'].output
    assert np.max(np.abs([message.error[:3] for message in tracking])) < bound
    assert 'currents cut' not in graph['plant'].output


@pytest.mark.alone
@pytest.mark.real_time
def test_retuning_in_real_time(nodes: Nodes, watching: Observer) -> None:
    graph = fly(nodes, LONG, mode='realtime')
    watching.wait(lambda: watching.newest(REFERENCE) is not None)
    retune(graph, watching, bound=500e-6)  # the service itself holds the loop up for some samples


@pytest.mark.parametrize(
    ('name', 'argument', 'said'),
    [
        ('plant', 'amplifier.peak_curent:=7.0', "did you mean 'amplifier.peak_current'"),
        ('plant', 'sample_time:=1.0', "'sample_time' is 1"),
        ('controller', 'invers:=exact', "did you mean 'inverse'"),
        ('controller', 'machine.mass_y:=6900.0', "'machine.mass_y' is 6900"),
        ('controller', 'inverse:=exactly', "'inverse' is 'exactly'"),
        ('reference', 'duration:=ten', "'duration' is 'ten'"),
        ('monitor', 'timeout:=.nan', "'timeout' is nan"),
        ('recorder', 'outptu:=/nowhere', "did you mean 'output'"),
    ],
)
def test_a_wrong_parameter_is_refused(nodes: Nodes, name: str, argument: str, said: str) -> None:
    node = nodes.start(name, argument)
    assert node.wait() == 1
    assert said in node.output
    assert len(node.output.strip().splitlines()) == 1


def test_a_missing_parameter_file_is_one_line(nodes: Nodes) -> None:
    node = nodes.start('plant', params=('no_such_file.yaml',))
    assert node.wait() == 1
    assert 'no_such_file.yaml' in node.output
