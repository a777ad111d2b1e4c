"""What internal models learn from where the reference rests."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bench import HOVER, Bench
from hypothesis import assume, given
from hypothesis import strategies as st

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import FloatArray, X, Y, Z
from maglev_model.parameters import build

COUNT, WITHIN = 1e-5, 0.05


def learns(
    bench: Bench, y: float = 0.0, x: float = 0.0, z: float = 0.0, speed: float = 0.0
) -> FloatArray:
    """What it learns from errors at a sample, by axis."""
    bench.step(HOVER[0] + y, x, z, velocity=np.array([0.0, speed, speed, 0.0, 0.0]))
    learned: FloatArray = bench.regulator.arrays.sample['learned_error'].copy()
    return learned


def at_rest(**chosen: object) -> Bench:
    """After the second that its oscillators take to fade."""
    table = {'internal_model.within_count': WITHIN, **chosen}
    bench = Bench(build(ControllerParameters, table))
    for _ in range(1000):
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
