"""How far from its reference a platen may be, and for how long after a jump."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_controller.following_error import FollowingWatch
from maglev_controller.parameters import ControllerParameters
from maglev_model.parameters import build

ZERO = np.zeros(5)
MOST = (1e-3, 2e-3, 2e-3, 3e-3, 3e-3)


def along(axis: int, size: float) -> np.ndarray:
    return size * (np.arange(5) == axis)


@pytest.fixture(scope='module')
def made() -> FollowingWatch:
    return FollowingWatch(ControllerParameters())


@pytest.fixture
def watch(made: FollowingWatch) -> FollowingWatch:
    made.reset()
    made.step(ZERO, ZERO, ZERO)
    return made


@pytest.mark.parametrize('sign', [-1.0, 1.0])
@pytest.mark.parametrize(('axis', 'most'), enumerate(MOST))
def test_each_axis_has_its_own_bound(
    watch: FollowingWatch, axis: int, most: float, sign: float
) -> None:
    assert watch.step(ZERO, ZERO, along(axis, sign * 0.999 * most)) == ''
    assert 'following.error' in watch.step(ZERO, ZERO, along(axis, sign * 1.001 * most))


def test_an_error_that_is_no_number_is_too_large(watch: FollowingWatch) -> None:
    assert watch.step(ZERO, ZERO, along(2, math.nan))


@given(jump=st.floats(1e-3, 0.06), samples=st.integers(0, 3000))
def test_a_jump_is_allowed_for_and_fades(made: FollowingWatch, jump: float, samples: int) -> None:
    for share in (0.999, 1.001):
        made.reset()
        made.step(ZERO, ZERO, ZERO)
        for _ in range(samples):
            assert not made.step(along(1, jump), ZERO, ZERO)
        allowed = 2e-3 + jump * math.exp(-1e-3 * samples)
        assert bool(made.step(along(1, jump), ZERO, along(1, share * allowed))) == (share > 1.0)


@given(speed=st.floats(-0.5, 0.5), acceleration=st.floats(-20.0, 20.0))
def test_a_reference_that_moves_as_fast_as_it_says_does_not_jump(
    made: FollowingWatch, speed: float, acceleration: float
) -> None:
    made.reset()
    for n in range(201):
        t = 1e-3 * n
        place = along(1, speed * t + 0.5 * acceleration * t**2)
        moving = along(1, speed + acceleration * t)
        error = (1.999e-3 if n < 200 else 2.001e-3) if n else 0.0
        assert bool(made.step(place, moving, along(1, error))) == (n == 200)


def test_one_that_does_not_say_how_fast_it_moves_is_allowed_what_it_moved(
    watch: FollowingWatch,
) -> None:
    for n in range(1, 51):
        assert not watch.step(along(2, 1e-4 * n), ZERO, along(2, 6e-3 * n / 50))


def test_the_first_error_is_a_jump(made: FollowingWatch) -> None:
    made.reset()
    assert not made.step(ZERO, ZERO, along(0, 5e-3))
    assert not made.step(ZERO, ZERO, along(0, 5.9e-3))
    assert made.step(ZERO, ZERO, along(0, 6.1e-3))


def test_the_time_of_fading_and_the_bounds_are_parameters() -> None:
    watch = FollowingWatch(
        build(
            ControllerParameters,
            {'following.fading': 0.01, 'following.error': (0.1, 0.1, 0.1, 0.1, 0.2)},
        )
    )
    watch.step(ZERO, ZERO, along(3, 0.5))
    for _ in range(60):
        assert not watch.step(ZERO, ZERO, ZERO)
    assert not watch.step(ZERO, ZERO, along(4, 0.199))
    assert watch.step(ZERO, ZERO, along(3, 0.11))


def test_where_it_may_be_larger_for_a_time_only_what_lasts_without_a_break_is_too_large() -> None:
    watch = FollowingWatch(build(ControllerParameters, {'following.time': 0.02}))
    watch.step(ZERO, ZERO, ZERO)
    for _ in range(3):
        for _ in range(20):
            assert not watch.step(ZERO, ZERO, along(0, 2e-3))
        assert not watch.step(ZERO, ZERO, ZERO)
    for _ in range(20):
        assert not watch.step(ZERO, ZERO, along(0, 2e-3))
    assert watch.step(ZERO, ZERO, along(0, 2e-3))
    watch.reset()
    assert not watch.step(ZERO, ZERO, along(0, 2e-3))


@pytest.mark.parametrize(
    ('time', 'grace', 'samples'), [(0.0, 0.05, 50), (0.02, 0.05, 50), (0.02, 0.0, 20)]
)
def test_after_a_reset_there_may_be_grace(time: float, grace: float, samples: int) -> None:
    watch = FollowingWatch(build(ControllerParameters, {'following.time': time}))
    watch.reset(grace)
    watch.step(ZERO, ZERO, ZERO)
    assert not any(watch.step(ZERO, ZERO, along(3, 4e-3)) for _ in range(samples))
    assert watch.step(ZERO, ZERO, along(3, 4e-3))
    watch.reset()
    watch.step(ZERO, ZERO, ZERO)
    assert not any(watch.step(ZERO, ZERO, along(3, 4e-3)) for _ in range(round(time / 1e-3)))
    assert watch.step(ZERO, ZERO, along(3, 4e-3))
