"""In lockstep a stage waits for those who watch: a made-up stage, on a node that only notes."""

from __future__ import annotations

import time

import pytest
from made_up_node import MadeUpNode
from made_up_stage import MadeUpStage, currents, start

from maglev_msgs.msg import Measurement
from maglev_node import flow_control
from maglev_node.flow_control import PATIENCE, WINDOW
from maglev_node.topics import MEASUREMENT, progress_of

NAMES = ('recorder', 'rosbag2')


class Clock:
    """A clock that a test sets."""

    now = 100.0

    def monotonic(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """That by which patience goes."""
    clock = Clock()
    monkeypatch.setattr(flow_control, 'time', clock)
    return clock


@pytest.fixture
def node(clock: Clock) -> MadeUpNode:
    """One whose stage is answered by a controller, in sight of both that watch."""
    _, node = start(MadeUpStage(), watchers=NAMES)
    node.subscribers = {MEASUREMENT: list(NAMES)}
    node.tick()
    time.sleep(0.11)  # the middleware gets the time to match them
    return node


def told(node: MadeUpNode, sequence: int, name: str = 'recorder') -> None:
    """A watcher tells how far it is."""
    node.hears[progress_of(name)](Measurement(sequence=sequence))


def answer_all(node: MadeUpNode, until: int) -> int:
    """Answer each sample that comes, to one at most; the newest."""
    while (newest := node.measured[-1]) < until:
        node.answer(currents(newest, 0.5))
        if node.measured[-1] == newest:
            break
    return node.measured[-1]


def test_one_that_told_is_waited_for_until_it_tells_more(node: MadeUpNode) -> None:
    told(node, 10)
    assert answer_all(node, 3 * WINDOW) == WINDOW + 10
    node.answer(currents(WINDOW + 10, 0.5))  # once more: the sample is answered already
    node.tick()
    assert node.measured[-1] == WINDOW + 10
    told(node, 30)
    node.tick()
    assert answer_all(node, 3 * WINDOW) == WINDOW + 30
    assert node.measured[-40:] == list(range(WINDOW - 9, WINDOW + 31))  # none twice, none left out
    assert not node.failed


def test_no_longer_than_it_goes_on_telling(node: MadeUpNode, clock: Clock) -> None:
    told(node, 10)
    answer_all(node, 3 * WINDOW)
    clock.now += 0.99 * PATIENCE
    node.tick()
    assert node.measured[-1] == WINDOW + 10
    clock.now += 0.02 * PATIENCE
    node.tick()
    assert answer_all(node, 3 * WINDOW) == 3 * WINDOW
    told(node, 20)  # it goes on, and is waited for again
    assert answer_all(node, 4 * WINDOW) == 3 * WINDOW


def test_the_slowest_counts_and_who_never_told_does_not(node: MadeUpNode) -> None:
    assert answer_all(node, 2 * WINDOW) == 2 * WINDOW
    told(node, 2 * WINDOW)
    assert answer_all(node, 4 * WINDOW) == 3 * WINDOW
    told(node, 2 * WINDOW + 7, 'rosbag2')
    told(node, 3 * WINDOW)
    node.tick()
    assert answer_all(node, 4 * WINDOW) == 3 * WINDOW + 7


def test_in_real_time_it_waits_for_nobody() -> None:
    _, node = start(MadeUpStage(), mode='realtime', watchers=NAMES)
    assert not node.hears
