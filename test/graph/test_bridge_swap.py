"""Plant out, bridge in, under a controller and a reference that keep running."""

from __future__ import annotations

import signal

from flight import BRISK, WATCHED
from graph import Nodes, Observer

from maglev_msgs.msg import Reference
from maglev_node.topics import REFERENCE, SAMPLE_TOPICS, TRUE_STATE


def test_land_swap_lift_off(nodes: Nodes, observer: Observer) -> None:
    observer.watch(*SAMPLE_TOPICS)

    def airborne() -> bool:
        newest = observer.newest(TRUE_STATE)
        return newest is not None and newest.state[0] < 0.026

    def flights() -> int:
        return reference.output.count('END at sample')

    plant = nodes.start('plant', WATCHED, params=('benchmark.yaml',))
    controller = nodes.start('controller', WATCHED)
    reference = nodes.start(
        'reference',
        WATCHED,
        'autostart:=false',
        'duration:=600.0',
        *BRISK,
        params=('scenario_ellipse.yaml',),
    )
    observer.wait(lambda: observer.newest(REFERENCE) is not None)
    assert observer.call('/reference/lift_off').success
    observer.wait(airborne)
    assert observer.call('/reference/land').success
    observer.wait(lambda: flights() == 1)
    plant.signal(signal.SIGTERM)
    assert plant.wait() == 0

    count = len(observer.look()[TRUE_STATE])
    bridge = nodes.start('hw_bridge', WATCHED, params=('hw_bridge.yaml',))
    observer.wait(lambda: len(observer.look()[TRUE_STATE]) > count + 200)
    observer.wait(lambda: observer.newest(REFERENCE).phase == Reference.REST)
    assert observer.call('/reference/lift_off').success
    observer.wait(airborne)
    assert observer.call('/reference/land').success
    observer.wait(lambda: flights() == 2)
    observer.wait(lambda: abs(observer.newest(TRUE_STATE).state[0] - 0.031) < 1e-4)  # in time
    for process in (controller, reference, bridge):
        assert process.running, process.output
