"""One state machine over three nodes: who waits, who gives way, and what it takes to fly again."""

from __future__ import annotations

import signal

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from flight import (
    LONG,
    LOWER_STOP,
    WATCHED,
    airborne,
    fly,
    gap,
    idles,
    impact_speed,
    landed_without_current,
    samples,
)
from graph import Nodes, Observer
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState

from maglev_msgs.msg import ControllerState, Reference
from maglev_node.topics import (
    CONTROLLER_STATE,
    CURRENTS,
    DIAGNOSTICS,
    REFERENCE,
    SILENCE,
    TRUE_STATE,
)


def mode(observer: Observer) -> int:
    """The controller's newest mode."""
    return int(observer.newest(CONTROLLER_STATE).mode)


def phase(observer: Observer) -> int:
    """The newest phase the reference has published."""
    return int(observer.newest(REFERENCE).phase)


def test_a_controller_disabled_or_in_a_fault_is_not_flown_with(
    nodes: Nodes, watching: Observer
) -> None:
    """Lift-off is refused while it is disabled; after its emergency stop only a lift-off flies."""
    graph = fly(nodes, LONG, 'lift_off.time:=4.0', controller=('enabled:=false',))
    watching.wait(lambda: watching.newest(CONTROLLER_STATE) is not None)
    graph['reference'].wait_for('resting, the controller is disabled: call /controller/enable')
    answer = watching.call('/reference/lift_off')
    assert not answer.success
    assert 'the controller is disabled' in answer.message
    assert 'call /controller/enable, then /reference/lift_off' in answer.message
    samples(watching, 30)
    assert watching.call('/controller/enable', True).success
    watching.wait(lambda: mode(watching) == ControllerState.WAITING)
    samples(watching, 30)
    assert mode(watching) == ControllerState.WAITING
    assert {message.phase for message in watching.look()[REFERENCE]} == {Reference.REST}
    assert not any(np.any(message.direct_current) for message in watching.look()[CURRENTS])
    assert gap(watching) == pytest.approx(LOWER_STOP, abs=1e-5)
    assert watching.call('/reference/lift_off').success

    watching.wait(lambda: gap(watching) < LOWER_STOP - 2e-4)
    assert watching.call('/controller/emergency_stop').success
    graph['reference'].wait_for('the controller lands by itself')
    watching.wait(lambda: phase(watching) == Reference.END)
    watching.wait(lambda: mode(watching) == ControllerState.FAULT)
    samples(watching, 10)
    refused = watching.call('/reference/lift_off')
    assert not refused.success
    services = '/controller/reset, then /controller/enable, then /reference/lift_off'
    assert services in refused.message
    watching.wait(lambda: landed_without_current(watching))
    assert watching.call('/controller/reset').success
    assert watching.call('/controller/enable', True).success
    watching.wait(lambda: mode(watching) == ControllerState.WAITING)
    samples(watching, 30)
    assert mode(watching) == ControllerState.WAITING
    assert phase(watching) == Reference.END
    assert landed_without_current(watching)
    first = watching.newest(CONTROLLER_STATE).sequence
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))
    flown = [m for m in watching.look()[CONTROLLER_STATE] if m.sequence > first]
    assert max(abs(m.error[0]) for m in flown if m.mode == ControllerState.REGULATING) < 2e-4


def test_emergency_stops_in_flight_and_the_way_back(nodes: Nodes, watching: Observer) -> None:
    """The controller's lands and is latched; the plant's too, and off its stop none lifts off."""
    graph = fly(nodes, LONG, 'trajectory:=hold')  # where the magnets bear more than the weight
    watching.wait(lambda: airborne(watching))
    assert watching.call('/controller/emergency_stop').success
    watching.wait(lambda: mode(watching) == ControllerState.FAULT)
    watching.wait(lambda: landed_without_current(watching))
    assert impact_speed(watching) < 0.05
    assert not watching.call('/controller/enable', True).success
    assert watching.call('/controller/reset').success
    assert watching.call('/controller/enable', True).success
    watching.wait(lambda: mode(watching) == ControllerState.WAITING)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))

    assert watching.call('/plant/emergency_stop').success
    graph['plant'].wait_for('currents cut')
    watching.wait(lambda: not np.any(watching.newest(TRUE_STATE).direct_current))
    watching.wait(lambda: gap(watching) < 0.0181)  # the magnets pull it up
    watching.wait(lambda: mode(watching) == ControllerState.FAULT)  # it does not follow any more
    assert watching.call('/plant/reset').success
    assert not watching.call('/plant/reset').success
    assert not watching.call('/controller/enable', True).success
    assert watching.call('/controller/reset').success
    assert watching.call('/controller/enable', True).success
    samples(watching, 300)
    answer = watching.call('/reference/lift_off')
    assert not answer.success
    assert 'not on its lower stop' in answer.message
    samples(watching, 30)
    assert phase(watching) == Reference.END
    client = watching.node.create_client(ChangeState, '/plant/change_state')
    for name in ('deactivate', 'cleanup', 'configure', 'activate'):  # a new platen, so to speak
        request = ChangeState.Request(transition=Transition(label=name))
        assert watching.ask(client, request).success, name
    watching.wait(lambda: phase(watching) == Reference.REST)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))


def test_without_measurements_a_lift_off_is_refused(nodes: Nodes, watching: Observer) -> None:
    """It would begin whenever the stage goes on."""
    graph = fly(nodes, LONG, 'autostart:=false')
    watching.wait(lambda: watching.newest(CONTROLLER_STATE) is not None)
    samples(watching, 30)
    graph['plant'].signal(signal.SIGSTOP)
    watching.serve(SILENCE['lockstep'] + 0.1)
    answer = watching.call('/reference/lift_off')
    assert not answer.success
    assert 'lift-off refused: no measurement for ' in answer.message
    graph['plant'].signal(signal.SIGCONT)
    samples(watching, 300)
    assert landed_without_current(watching)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))


@pytest.mark.parametrize('later', ['nobody', 'controller', 'reference'])
def test_a_stage_that_ends_in_flight_and_begins_anew(
    nodes: Nodes, watching: Observer, later: str
) -> None:
    """The others rest with it, whoever of them finds it first, and fly again by a lift-off."""
    graph = fly(nodes, LONG)
    watching.wait(lambda: airborne(watching))
    samples(watching, 500)
    graph['plant'].kill()
    if later in graph:
        graph[later].signal(signal.SIGSTOP)
    nodes.start('plant', WATCHED, params=('benchmark.yaml',))
    if later != 'reference':
        graph['reference'].wait_for('the stage began anew in flight: resting until ~/lift_off')
    if later != 'controller':
        graph['controller'].wait_for('the stage began anew')
    if later in graph:
        graph[later].signal(signal.SIGCONT)
    watching.wait(lambda: mode(watching) == ControllerState.WAITING)
    watching.wait(lambda: phase(watching) == Reference.REST)
    samples(watching, 30)
    assert landed_without_current(watching)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))


def test_a_run_whose_stage_began_anew_is_over(nodes: Nodes, watching: Observer) -> None:
    graph = fly(nodes, LONG, 'exit_at_end:=true')
    watching.wait(lambda: airborne(watching))
    graph['plant'].kill()
    nodes.start('plant', WATCHED, params=('benchmark.yaml',))
    assert graph['reference'].wait() == 1
    assert 'the run was left: the stage began anew in flight' in graph['reference'].output


def test_without_a_reference_stage_and_controller_say_what_lacks(
    nodes: Nodes, observer: Observer
) -> None:
    nodes.start('plant')
    controller = nodes.start('controller')
    diagnostics, said = observer.node.poll(DIAGNOSTICS, DiagnosticArray), dict[str, str]()
    expected = {
        'plant': 'waiting for the controller, or the reference it waits for',
        'controller': 'waiting for a reference on /reference',
    }

    def heard() -> bool:
        for message, _ in diagnostics.take():
            said.update({each.name: each.message for each in message.status})
        return said == expected

    observer.wait(heard)
    controller.wait_for(expected['controller'])


@pytest.mark.parametrize('name', ['controller', 'reference'])
@pytest.mark.parametrize('stage', ['lockstep', 'realtime'])
def test_mixed_modes_are_refused(nodes: Nodes, name: str, stage: str) -> None:
    nodes.start('plant', f'mode:={stage}')
    ours = {'lockstep': 'realtime', 'realtime': 'lockstep'}[stage]
    other = nodes.start(name, f'mode:={ours}')
    assert other.wait() == 1
    said = f"the stage runs in mode '{stage}', this node in mode '{ours}'"
    assert other.output.count(said) == 1  # however many measurements had queued up


@pytest.mark.parametrize('name', ['controller', 'reference'])
def test_mixed_sample_times_are_refused(nodes: Nodes, watching: Observer, name: str) -> None:
    wrong = ('sample_time:=0.0005',)
    mine, controllers = (wrong, ()) if name == 'reference' else ((), wrong)
    graph = fly(nodes, 'lift_off.wait:=1.0', *mine, controller=controllers)
    assert graph[name].wait() == 1
    assert "samples every 1 ms, this node's 'sample_time' is 0.5 ms" in graph[name].output
    assert not airborne(watching)


def test_nothing_hurries_after_the_end_and_a_dead_controller_is_noticed(
    nodes: Nodes, watching: Observer
) -> None:
    graph = fly(nodes, LONG, 'timeout:=4.0', plant=('answer_timeout:=3.0',))
    watching.wait(lambda: airborne(watching))
    assert watching.call('/reference/land').success
    watching.wait(lambda: phase(watching) == Reference.END)
    samples(watching, 1100)
    watching.wait(lambda: idles(watching), timeout=10.0)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching), timeout=10.0)

    graph['controller'].kill()
    assert graph['plant'].wait() == 1
    assert 'no currents for sample' in graph['plant'].output
    assert graph['reference'].wait() == 1
    assert 'no measurement for' in graph['reference'].output


@pytest.mark.parametrize('end', [signal.SIGKILL, signal.SIGTERM])
def test_at_rest_one_controller_follows_another(
    nodes: Nodes, watching: Observer, end: signal.Signals
) -> None:
    graph = fly(nodes, LONG, 'autostart:=false')
    watching.wait(lambda: watching.newest(CONTROLLER_STATE) is not None)
    samples(watching, 30)
    graph['controller'].signal(end)
    graph['controller'].wait()
    nodes.start('controller', WATCHED)
    samples(watching, 30)
    assert watching.call('/reference/lift_off').success
    watching.wait(lambda: airborne(watching))


def test_a_flight_that_has_lost_its_platen_ends(nodes: Nodes, watching: Observer) -> None:
    burden = 'disturbance.constant:=[5000.0, 0.0, 0.0, 0.0, 0.0]'  # more than all motors carry
    graph = fly(nodes, LONG, 'exit_at_end:=true', plant=(burden,))
    watching.wait(lambda: not graph['reference'].running, timeout=60.0)
    assert graph['reference'].wait() == 1
    assert 'left the run' in graph['reference'].output
    assert 'the controller is in a fault' in graph['reference'].output
    assert "m from its reference, more than 'following.error'" in graph['controller'].output
    assert gap(watching) == pytest.approx(LOWER_STOP, abs=2e-4)
    assert not [m for m in watching.look()[REFERENCE] if m.phase == Reference.TRACK]
