"""What internal models learn from where the reference rests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bench import HOVER, Bench
from hypothesis import assume, given
from hypothesis import strategies as st

from maglev_controller.parameters import ControllerParameters
from maglev_controller.step.rest import PUSH_TIME, STOOD, WEAKER
from maglev_model.axes import FloatArray, X, Y, Z
from maglev_model.parameters import build

COUNT, WITHIN = 1e-5, 0.05
SLIDES = 7.5e-4  # [m/s]


def learns(
    bench: Bench, y: float = 0.0, x: float = 0.0, z: float = 0.0, speed: float = 0.0
) -> FloatArray:
    """What it learns from errors at a sample, by axis."""
    bench.step(HOVER[0] + y, x, z, velocity=np.array([0.0, speed, speed, 0.0, 0.0]))
    learned: FloatArray = bench.regulator.arrays.sample['learned_error'].copy()
    return learned


def at_rest(**chosen: object) -> Bench:
    """After the second that its oscillators take to fade."""
    table = {
        'internal_model.within_count': WITHIN,
        'internal_model.slide_speed': (SLIDES, 0.0),
        **chosen,
    }
    bench = Bench(build(ControllerParameters, table))
    for _ in range(round(1.0 / bench.regulator.parameters.sample_time)):
        learns(bench)
    return bench


@pytest.fixture(scope='module')
def rested() -> tuple[Bench, tuple[Any, ...]]:
    """One, and what it remembers then."""
    bench = at_rest()
    return bench, bench.regulator.save()


@pytest.fixture
def bench(rested: tuple[Bench, tuple[Any, ...]]) -> Bench:
    rested[0].regulator.restore(rested[1])
    return rested[0]


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_less_is_learned_from_what_lies_within_a_count(
    rested: tuple[Bench, tuple[Any, ...]], x: float, z: float
) -> None:
    assume(min(abs(abs(x) - 0.5), abs(abs(z) - 0.5)) > 1e-9)
    rested[0].regulator.restore(rested[1])
    learned = learns(rested[0], x=x * COUNT, z=z * COUNT)
    for axis, counts in ((X, x), (Z, z)):
        share = WITHIN if abs(counts) <= 0.5 else 1.0
        assert learned[axis] == pytest.approx(share * counts * COUNT, rel=1e-5, abs=1e-15)


def test_where_several_encoders_tell_of_an_axis_it_learns_from_readings(bench: Bench) -> None:
    assert learns(bench, y=0.3 * COUNT)[Y] == pytest.approx(0.3 * COUNT, rel=1e-9)


def test_in_motion_it_learns_from_readings(bench: Bench) -> None:
    for _ in range(1000):
        learns(bench, x=0.9 * COUNT, speed=0.01)
    assert learns(bench, x=0.3 * COUNT, speed=0.01)[X] == pytest.approx(0.3 * COUNT, rel=1e-6)


@pytest.mark.parametrize(
    'chosen',
    [
        {'internal_model.within_count': 1.0},
        {'internal_model.rest': 'hold'},
        {'encoder.horizontal_resolution': 0.0},
    ],
)
def test_by_default_with_the_papers_oscillators_and_without_counts_too(
    chosen: dict[str, object],
) -> None:
    assert learns(at_rest(**chosen), x=0.3 * COUNT)[X] == 0.3 * COUNT


def over_the_edge(bench: Bench, beyond: float, back: float = 0.0, time: float = 0.005) -> float:
    """What it learns in all, from x ``beyond`` for a ``time`` [s] and then ``back`` for 0.2 s,
    after it has come back and beyond what it learns from where it is [m s]; counts."""
    period = bench.regulator.parameters.sample_time
    for _ in range(round(time / period)):
        learns(bench, x=beyond * COUNT)
    found = [learns(bench, x=back * COUNT)[X] for _ in range(round(0.2 / period))]
    return float(period * np.sum(np.array(found) - found[-1]))


@pytest.mark.parametrize('sample_time', [0.5e-3, 1e-3, 2e-3])
@pytest.mark.parametrize(('beyond', 'back'), [(0.7, -0.3), (-0.9, 0.1), (1.4, 0.4)])
def test_back_over_an_edge_it_learns_from_the_way_that_is_left(
    sample_time: float, beyond: float, back: float
) -> None:
    way = np.copysign(min(abs(beyond) - 0.5, 0.5), beyond) * COUNT
    learned = over_the_edge(at_rest(sample_time=sample_time), beyond, back)
    assert learned == pytest.approx(PUSH_TIME * way, abs=0.51 * sample_time * abs(way))


def test_not_on_the_way_back_from_farther_than_the_next_count(bench: Bench) -> None:
    assert over_the_edge(bench, 1.6) == pytest.approx(0.0, abs=1e-15)


def test_not_by_default() -> None:
    bench = at_rest(**{'internal_model.within_count': 1.0})
    assert over_the_edge(bench, 0.9) == pytest.approx(0.0, abs=1e-15)


def test_also_where_nobody_tells_how_fast_it_slides() -> None:
    bench = at_rest(**{'internal_model.slide_speed': (0.0, SLIDES)})
    assert over_the_edge(bench, 0.9) == pytest.approx(PUSH_TIME * 0.4 * COUNT, rel=1e-6)


def test_not_in_motion(bench: Bench) -> None:
    for _ in range(300):
        learns(bench, x=0.9 * COUNT, speed=0.01)
    assert learns(bench, speed=0.01)[X] == pytest.approx(0.0, abs=1e-9)


def test_a_reading_that_flickers_comes_back_once(bench: Bench) -> None:
    once = PUSH_TIME * 0.4 * COUNT
    for _ in range(30):  # 60 ms
        learns(bench, x=0.9 * COUNT)
        learns(bench, x=-0.1 * COUNT)
    assert over_the_edge(bench, 0.9, -0.1, time=0.001) == pytest.approx(0.0, abs=1e-15)
    assert over_the_edge(bench, 0.9, -0.1) == pytest.approx(once, rel=1e-6)


def test_who_is_pushed_over_the_other_edge_soon_is_pushed_less(bench: Bench) -> None:
    def way(side: float) -> float:
        return over_the_edge(bench, 0.7 * side) / (0.2 * COUNT * side)

    assert way(1.0) == pytest.approx(PUSH_TIME, rel=1e-6)
    assert way(-1.0) == pytest.approx(WEAKER * PUSH_TIME, rel=1e-6)
    assert way(-1.0) == pytest.approx(WEAKER * PUSH_TIME, rel=1e-6)
    for _ in range(600):  # then it was not pushed there, it drifted
        learns(bench)
    assert way(1.0) == pytest.approx(WEAKER * PUSH_TIME, rel=1e-6)
    for _ in range(300):
        learns(bench, speed=0.01)
    for _ in range(600):
        learns(bench)
    assert way(1.0) == pytest.approx(PUSH_TIME, rel=1e-6)


def virtual_inputs(bench: Bench, place: float, samples: int) -> list[float]:
    """w of x at samples at which x is at a ``place`` [counts]."""
    found = []
    for _ in range(samples):
        learns(bench, x=place * COUNT)
        found.append(float(bench.regulator.arrays.sample['virtual_input'][X]))
    return found


def test_what_broke_loose_slides_on(bench: Bench) -> None:
    *_, last = virtual_inputs(bench, 0.9, round(STOOD / 1e-3) + 5)
    goes_on = round(0.4 * COUNT / SLIDES / 1e-3 + 0.5)
    after = virtual_inputs(bench, -0.1, 3 * goes_on)
    assert after[:goes_on] == [last] * goes_on
    assert last not in after[goes_on:]


def test_also_while_its_reading_flickers_but_not_when_it_is_elsewhere(bench: Bench) -> None:
    *_, last = virtual_inputs(bench, 0.9, round(STOOD / 1e-3) + 5)
    assert virtual_inputs(bench, -0.1, 2) + virtual_inputs(bench, 0.9, 2) == [last] * 4
    assert last not in virtual_inputs(bench, 1.9, 1) + virtual_inputs(bench, -0.1, 5)


def test_without_a_speed_nothing_slides_on() -> None:
    bench = at_rest(**{'internal_model.slide_speed': (0.0, SLIDES)})
    *_, last = virtual_inputs(bench, 0.9, round(STOOD / 1e-3) + 5)
    assert last not in virtual_inputs(bench, -0.1, 5)


def test_what_did_not_stick_does_not_slide_on(bench: Bench) -> None:
    *_, last = virtual_inputs(bench, 0.9, round(STOOD / 1e-3) - 5)
    assert last not in virtual_inputs(bench, -0.1, 5)
