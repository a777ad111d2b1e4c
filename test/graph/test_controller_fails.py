"""Every way a controller can end in flight: it lands, or the bridge does, softly."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

import pytest
from flight import BRISK, ELLIPSE, LONG, LOWER_STOP, SWIFT, WATCHED, airborne, gap, impact_speed
from graph import Nodes, Observer, Process
from std_srvs.srv import Trigger

from maglev_msgs.msg import ControllerState, Currents, Measurement
from maglev_node.topics import CONTROLLER_STATE, CURRENTS, MEASUREMENT, TRUE_STATE, sample_qos

SOFT = 0.01  # [m/s]
FAILING = Path(__file__).resolve().parents[1] / 'support' / 'failing_controller.py'


TIRED = """
class Tired:
    def reset(self):
        self.left = 1500

    def step(self, measurement, reference):
        self.left -= 1
        error = measurement.position - reference.position
        rate = measurement.velocity - reference.velocity
        return reference.acceleration - 1e4 * error - 150.0 * rate + 0 // self.left

def make(parameters):
    return Tired()
"""


def fly(
    nodes: Nodes, observer: Observer, failing: str = '', controller: tuple[str, ...] = ()
) -> dict[str, Process]:
    """Bridge, controller and reference on the ellipse, until it is airborne."""
    graph = {'stage': nodes.start('hw_bridge', WATCHED, *SWIFT, params=('hw_bridge.yaml',))}
    if failing:
        command = [sys.executable, str(FAILING), failing, '--ros-args', '-p', WATCHED]
        graph['controller'] = nodes.run('controller', command)
    else:
        graph['controller'] = nodes.start('controller', WATCHED, *SWIFT, *controller)
    graph['reference'] = nodes.start('reference', LONG, WATCHED, *BRISK, params=(ELLIPSE,))
    observer.wait(lambda: airborne(observer), timeout=180.0)
    return graph


def landed_softly(observer: Observer) -> None:
    """Wait until the platen rests on its stop and stays there; it has come down softly."""

    def rests() -> bool:
        state = observer.newest(TRUE_STATE)
        return bool(abs(state.state[0] - LOWER_STOP) < 1e-5 and abs(state.state[1]) < 1e-4)

    observer.wait(rests, timeout=120.0)
    assert impact_speed(observer) <= SOFT


def test_its_emergency_stop_lands_and_stays(nodes: Nodes, watching: Observer) -> None:
    graph = fly(nodes, watching)
    before = watching.newest(MEASUREMENT).sequence
    graph['stage'].signal(signal.SIGSTOP)  # nothing goes on meanwhile
    assert 'landing' in watching.call('/controller/emergency_stop').message
    assert not watching.call('/controller/reset').success
    graph['stage'].signal(signal.SIGCONT)
    landed_softly(watching)
    states = [m for m in watching.look()[CONTROLLER_STATE] if m.sequence > before]
    assert ControllerState.LANDING in {m.mode for m in states}
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.FAULT)
    assert not watching.call('/controller/enable', True).success
    assert watching.call('/controller/reset').success
    assert 'fault' not in graph['stage'].output
    sent = [m for m in watching.look()[CURRENTS] if m.sequence > before]
    assert {m.status for m in sent} == {Currents.FLYING, Currents.RESTING}
    assert len({m.session for m in sent}) == 1


def test_two_signals_at_once_land_as_one_does(nodes: Nodes, watching: Observer) -> None:
    graph = fly(nodes, watching)
    for number in (signal.SIGINT, signal.SIGTERM):
        graph['controller'].signal(number)
        time.sleep(0.01)
    assert graph['controller'].wait(120.0) == 0
    nodes.start('controller', 'enabled:=false')  # in lockstep samples go on with one only
    landed_softly(watching)
    assert 'fault' not in graph['stage'].output
    judge_whose_currents_flow(watching)


def judge_whose_currents_flow(watching: Observer) -> None:
    """With each sample the stage says whose currents it follows: the flying controller's."""
    topics = watching.look()
    flown = {m.sequence: m.session for m in topics[CURRENTS] if m.status == Currents.FLYING}
    said = {m.sequence: m.controller for m in topics[MEASUREMENT]}
    assert set(said.values()) == {0, *flown.values()}
    follow = [number for number in flown if flown.get(number - 1) and number in said]
    assert len(follow) > 1000
    assert all(said[number] == flown[number] for number in follow)


@pytest.mark.parametrize('how', ['beside', 'in_loop'])
def test_a_defect_where_references_are_taken_is_a_landing_of_its_own(
    nodes: Nodes, watching: Observer, how: str
) -> None:
    graph = fly(nodes, watching, how)
    assert graph['controller'].wait(120.0) == 70
    nodes.start('controller', 'enabled:=false')
    landed_softly(watching)
    assert 'landing at sample' in graph['controller'].output
    assert "defect: RuntimeError('made to fail')" in graph['controller'].output
    assert 'fault' not in graph['stage'].output


@pytest.mark.parametrize('how', ['law', 'measurement'])
def test_where_it_cannot_go_on_the_bridge_lands(nodes: Nodes, watching: Observer, how: str) -> None:
    graph = fly(nodes, watching, how)
    graph['stage'].wait_for('the controller gave up (landed by the stage)', timeout=120.0)
    landed_softly(watching)
    if how == 'law':
        assert graph['controller'].wait() == 70
    else:
        assert 'the measurement is not finite' in graph['controller'].output
        watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.FAULT)
    assert graph['stage'].running


def test_a_law_of_ones_own_that_fails_is_landed(
    nodes: Nodes, watching: Observer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'my_laws').mkdir()
    (tmp_path / 'my_laws' / 'tired.py').write_text(TIRED)
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}{os.pathsep}{os.environ["PYTHONPATH"]}')
    graph = fly(nodes, watching, controller=('law:=my_laws.tired',))
    graph['controller'].wait_for('the law my_laws.tired raised ZeroDivisionError', timeout=120.0)
    landed_softly(watching)
    watching.wait(lambda: watching.newest(CONTROLLER_STATE).mode == ControllerState.FAULT)
    assert 'the law my_laws.tired gives accelerations' in graph['controller'].output
    assert 'fault' not in graph['stage'].output


def test_whoever_else_publishes_currents_is_not_obeyed(nodes: Nodes, watching: Observer) -> None:
    graph = fly(nodes, watching)
    publisher = watching.node.create_publisher(Currents, CURRENTS, sample_qos())
    watching.wait(lambda: publisher.get_subscription_count() >= 2)
    newest = watching.newest(CURRENTS)
    publisher.publish(
        Currents(header=newest.header, sequence=newest.sequence, direct_current=[5.0] * 4)
    )
    graph['stage'].wait_for('somebody else')
    landed_softly(watching)
    assert gap(watching) == pytest.approx(LOWER_STOP, abs=1e-5)


def test_into_the_flight_of_another_controller_none_speaks(
    nodes: Nodes, watching: Observer
) -> None:
    controller = nodes.start('controller', 'enabled:=false')
    publisher = watching.node.create_publisher(Measurement, MEASUREMENT, sample_qos())
    watching.wait(lambda: publisher.get_subscription_count() >= 2)
    watching.serve(0.3)

    def measure(sequence: int, flown_by: int) -> None:
        publisher.publish(Measurement(sequence=sequence, controller=flown_by, lockstep=True))

    measure(7, flown_by=12)
    controller.wait_for('silent since sample 7: another controller flies this stage')
    measure(8, flown_by=12)
    measure(9, flown_by=0)
    watching.wait(lambda: bool(watching.look()[CURRENTS]))
    assert [m.sequence for m in watching.look()[CURRENTS]] == [9]
    own = watching.newest(CURRENTS).session
    measure(10, flown_by=own)
    watching.wait(lambda: watching.newest(CURRENTS).sequence == 10)
    assert controller.output.count('silent') == 1


DESIGN_STOPS = """
import os, signal, sys
if 'maglev_controller.design_process' in sys.orig_argv[-1]:
    os.kill(os.getpid(), signal.SIGSTOP)
"""


def stopped_design(controller: Process) -> int:
    """The process in which it designs, once that has stopped itself."""
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        with contextlib.suppress(OSError):  # a thread has ended meanwhile
            for children in Path(f'/proc/{controller.pid}/task').glob('*/children'):
                for child in children.read_text().split():
                    if ') T ' in Path(f'/proc/{child}/stat').read_text('utf-8'):
                        return int(child)
        time.sleep(0.01)
    raise AssertionError(f'it never designed:\n{controller.output}')


def test_during_a_redesign_the_emergency_stop_is_served(
    nodes: Nodes, watching: Observer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / 'sitecustomize.py').write_text(DESIGN_STOPS)
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}:{os.environ["PYTHONPATH"]}')
    controller = fly(nodes, watching)['controller']
    client = watching.node.create_client(Trigger, '/controller/emergency_stop')
    watching.make_heard(client)
    changing = watching.begin_to_set('controller', y__bandwidth=180.0)
    design = stopped_design(controller)
    watching.ask(client, Trigger.Request())
    assert not changing.done()
    os.kill(design, signal.SIGCONT)
    states = watching.messages[CONTROLLER_STATE]
    watching.wait(lambda: ControllerState.LANDING in states.every('mode'))
    landed_softly(watching)
    assert watching.answer(changing).result is not None
