"""In lockstep the loop waits for those who watch, and is not stopped by them."""

from __future__ import annotations

import pytest
from flight import LONG, airborne, fly
from graph import Nodes, Observer

from maglev_msgs.msg import ControllerState, Measurement
from maglev_node.flow_control import PATIENCE, WINDOW
from maglev_node.topics import CONTROLLER_STATE, MEASUREMENT, TRUE_STATE, progress_of, sample_qos


def test_a_slow_watcher_loses_nothing_and_a_silent_one_holds_nothing_up(
    nodes: Nodes, watching: Observer
) -> None:
    telling = watching.node.create_publisher(Measurement, progress_of('observer'), sample_qos(1))
    fly(nodes, LONG)
    watching.wait(lambda: telling.get_subscription_count() == 1 and airborne(watching))

    def newest() -> int:
        return int(watching.newest(MEASUREMENT).sequence)

    def held_at(told: int) -> bool:
        """Whether it waits for one that says so."""
        telling.publish(Measurement(sequence=told))
        assert newest() <= told + WINDOW
        return newest() == told + WINDOW

    first = newest()
    for told in range(first, first + 1000, 100):
        watching.wait(lambda told=told: held_at(told))
    held = newest()
    watching.wait(lambda: newest() > held + 2 * WINDOW, timeout=4.0 * PATIENCE + 5.0)
    modes = [m.mode for m in watching.look()[CONTROLLER_STATE] if m.sequence > held - WINDOW]
    assert set(modes) == {ControllerState.REGULATING}


@pytest.mark.parametrize('name', ['recorder', 'monitor'])
def test_each_tells_how_far_it_is(nodes: Nodes, observer: Observer, name: str) -> None:
    topic = progress_of(name)
    observer.watch(MEASUREMENT, TRUE_STATE, topic)
    output = f'output:={nodes.folder / "output"}'
    nodes.start(name, output)
    fly(nodes, LONG, watched=(f'watchers:=[{name}]',))
    observer.wait(lambda: airborne(observer))
    before = observer.newest(MEASUREMENT).sequence
    observer.wait(lambda: observer.newest(topic).sequence > before, timeout=2.0)
    assert observer.newest(topic).sequence > observer.newest(MEASUREMENT).sequence - WINDOW
