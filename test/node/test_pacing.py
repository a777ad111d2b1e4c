"""When samples are taken in real time."""

from __future__ import annotations

import pytest

from maglev_node.pacing import Deadlines, Pace, StageClock


class Clock:
    """A clock that is set by hand [s]."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def tick(pace: Pace, sequence: int, late: list[float] | None = None) -> int:
    """Samples that one tick takes after that newest sample, the n-th of them ``late[n]`` late."""
    taken = 0
    pace.behind(sequence)
    while True:
        taken += 1
        delay = 0.0 if late is None else late[min(taken, len(late)) - 1]
        if not pace.again(sequence + taken, taken, delay):
            return taken


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def deadlines(clock: Clock) -> Deadlines:
    pace = Deadlines(1e-3, clock)
    clock.now += 5.0
    pace.start(7)
    return pace


def test_deadlines_are_absolute(deadlines: Deadlines, clock: Clock) -> None:
    start = clock.now
    for n in range(1, 1000):
        clock.now = start + n * 1e-3 + 1e-5 + 4e-4 * (n % 2)  # ticks come late now and then
        assert deadlines.behind(6 + n) == pytest.approx(1e-3)
        assert tick(deadlines, 6 + n) == 1


def test_held_up_two_samples_a_tick_until_it_has_caught_up(
    deadlines: Deadlines, clock: Clock
) -> None:
    clock.now += 0.0104
    sequence, ticks = 7, []
    while sequence < 17:
        assert deadlines.behind(sequence) == pytest.approx((17 - sequence) * 1e-3)
        ticks.append(tick(deadlines, sequence))
        sequence += ticks[-1]
    assert ticks == [2] * 5
    assert deadlines.wait(0.0) is None


def test_the_clock_of_the_stage_paces_while_it_is_on_time() -> None:
    pace = StageClock(1e-3)
    pace.start(0)
    assert pace.behind(5) == 0.0
    assert tick(pace, 5, [0.9e-3]) == 1
    assert pace.period == pytest.approx(0.7e-3)
    assert pace.wait(0.1e-3) == pytest.approx(0.6e-3)
    assert pace.wait(0.5) == pytest.approx(50e-6)  # the graph is served in any case


def test_samples_that_wait_in_the_stage_are_taken_at_once() -> None:
    pace = StageClock(1e-3)
    assert tick(pace, 5, [3.2e-3, 2.2e-3, 1.2e-3, 0.2e-3]) == 4
    assert tick(pace, 5, [1.0]) == 20  # then the graph has its turn
