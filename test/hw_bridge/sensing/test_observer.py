"""The observer of the bridge against the plant's own equations, the geometry (5), and its poles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import observer
from maglev_hw_bridge.sensing.guard import Guard
from maglev_hw_bridge.sensing.observer import Flags
from maglev_model.axes import PHI, THETA, X, Y, Z
from maglev_model.machine import machine_constants
from maglev_model.parameters import build
from maglev_model.platen import gaps_from_outputs, output_accelerations

PARAMETERS = build(BridgeParameters, {'commutation.offset': (0.1, -0.2, 0.3, 1.0)})
MACHINE = machine_constants(PARAMETERS.machine)
LOWER = np.array(PARAMETERS.machine.lower_limit)
UPPER = np.array(PARAMETERS.machine.upper_limit)
FRICTION = np.array(PARAMETERS.fault.friction)
T = PARAMETERS.sample_time
POLE = np.exp(-PARAMETERS.fault.bandwidth * T)

five = st.tuples(*[st.floats(-1.0, 1.0)] * 5).map(np.array)
four = st.tuples(*[st.floats(-3.0, 3.0)] * 4).map(np.array)
flags = st.tuples(*[st.booleans()] * 6).map(np.array)


def watched_at(share: np.ndarray, rate: np.ndarray, pushed: np.ndarray) -> observer.ObserverArrays:
    """An observer somewhere between the stops, -1 to 1, that moves and has a disturbance."""
    watched = Guard(PARAMETERS).arrays
    watched.position[:] = 0.5 * (LOWER + UPPER) + 0.5 * share * (UPPER - LOWER)
    watched.rate[:], watched.disturbance[:] = rate, pushed
    return watched


def lengths(position: np.ndarray) -> np.ndarray:
    """What the encoders read of a platen there."""
    gap = np.empty(4)
    gaps_from_outputs(MACHINE, position, gap)
    return np.array([*gap, position[X], position[Z]])


@settings(max_examples=150)
@given(share=five, rate=five, pushed=five, i_d=four, i_q=four)
def test_it_foretells_what_the_plant_does(
    share: np.ndarray, rate: np.ndarray, pushed: np.ndarray, i_d: np.ndarray, i_q: np.ndarray
) -> None:
    """By (6), (7) with the phase currents that flow; what meets a stop stands there."""
    watched = watched_at(share, 0.1 * rate, 3.0 * pushed)
    amplifiers = Amplifiers(PARAMETERS)
    before, moving = watched.position.copy(), watched.rate.copy()
    amplifiers.drive(i_d, i_q, before[X], before[Z])
    observer.predict(watched.block[0], amplifiers.arrays.wanted)
    push = np.array(output_accelerations(MACHINE, *before[[0, 3, 4]], i_d, i_q))
    total = push + 3.0 * pushed
    np.testing.assert_allclose(watched.acceleration, total, rtol=1e-9, atol=1e-9)
    free = before + T * moving + 0.5 * T * T * total
    np.testing.assert_allclose(watched.position, np.clip(free, LOWER, UPPER), atol=1e-15)
    within = (free > LOWER) & (free < UPPER)
    np.testing.assert_allclose(watched.rate, np.where(within, moving + T * total, 0.0), atol=1e-9)
    np.testing.assert_allclose(watched.length, lengths(watched.position), atol=1e-15)
    change = lengths(watched.position) - lengths(before)
    np.testing.assert_allclose(watched.step, change, atol=1e-15)


@settings(max_examples=200)
@given(
    share=five,
    seated=st.booleans(),
    moved=five,
    then=five,
    time=st.floats(0.0, 0.05),
    i_d=four,
)
def test_the_model_alone_moves_what_friction_and_stops_let_go(
    share: np.ndarray,
    seated: bool,
    moved: np.ndarray,
    then: np.ndarray,
    time: float,
    i_d: np.ndarray,
) -> None:
    """What is left of the rate that the model has gained since the last count.

    Friction may have taken as much as it can in that time; what is seated may be held by its
    support, and tilts that cannot turn there by anything. At a stop nothing moves into it.
    """
    share = 0.9 * share
    share[0] = 1.0 if seated else share[0]
    watched = watched_at(share, np.zeros(5), np.zeros(5))
    watched.model_rate[:], watched.disturbance_then[:], watched.still_time[:] = (
        0.2 * moved,
        then,
        time,
    )
    tilted = watched.position[[0, 3, 4]]
    push = np.array(output_accelerations(MACHINE, *tilted, i_d, np.zeros(4)))
    amplifiers = Amplifiers(PARAMETERS)
    amplifiers.drive(i_d, np.zeros(4), watched.position[X], watched.position[Z])
    observer.predict(watched.block[0], amplifiers.arrays.wanted)
    gained = 0.2 * moved + T * (push + then)
    holds = FRICTION + np.array([1.5 if seated else 0.0, 0.0, 0.0, 0.0, 0.0])
    holds += np.clip(np.sign(gained) * then, 0.0, FRICTION)
    left = np.abs(gained) - holds * (time + T)
    if seated:
        left[[PHI, THETA]] = -1.0
        left[Y] = left[Y] if gained[Y] < 0.0 else -1.0
    goes = left > 0.0
    if np.any(np.abs(left) < 1e-9):
        return
    np.testing.assert_allclose(
        watched.least_rate, np.where(goes, np.sign(gained) * left, 0.0), rtol=1e-6, atol=1e-9
    )
    np.testing.assert_allclose(watched.model_rate, np.where(goes, gained, 0.0), atol=1e-9)
    np.testing.assert_allclose(watched.still_time, np.where(goes, time + T, 0.0), atol=1e-12)


@pytest.mark.parametrize('off', [1.0, -1.0])
@pytest.mark.parametrize('way', [1.0, -1.0])
@pytest.mark.parametrize('rested', [False, True])
def test_of_what_rests_half_the_friction_is_in_doubt_where_homing_has_lifted_it(
    off: float, way: float, rested: bool
) -> None:
    """And none of what is off: it rises by that for sure. Else friction, twice, and the support."""
    then = np.array([off, 0.0, 0.0, 0.0, 0.0])
    watched = watched_at(np.array([1.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(5), then)
    watched.position[Y] = UPPER[Y] - 1e-4
    watched.rested, watched.model_rate[Y] = rested, 0.1 * way
    watched.disturbance[Y] = watched.disturbance_then[Y] = off
    push = output_accelerations(MACHINE, *watched.position[[0, 3, 4]], np.zeros(4), np.zeros(4))[0]
    observer.predict(watched.block[0], np.zeros(12))
    gained = 0.1 * way + T * (push + off)
    held = 0.5 * FRICTION[Y] if rested else 1.5 + FRICTION[Y] * (1.0 + (way * off > 0.0))
    towards_the_stop = way > 0.0
    expected = 0.0 if towards_the_stop else -(abs(gained) - held * T)
    assert watched.least_rate[Y] == pytest.approx(expected, rel=1e-6)
    assert bool(watched.rested) is rested


@pytest.mark.parametrize('above', [1.9e-4, 2.1e-4])
def test_what_has_left_its_stop_rests_no_more(above: float) -> None:
    watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
    watched.position[Y], watched.rested = UPPER[Y] - above, True
    observer.predict(watched.block[0], np.zeros(12))
    assert bool(watched.rested) is (above < 2e-4)
    watched.rested = True
    observer.start(watched.block[0], lengths(watched.position))
    assert not watched.rested


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize('stop', ['lower', 'upper'])
def test_a_stop_may_carry_what_is_near_it(axis: int, stop: str) -> None:
    """Within 0.2 mm, or 0.1 mrad of a tilt's."""
    near = 2e-4 if axis < 3 else 1e-4
    end, way = {'lower': (LOWER, 1.0), 'upper': (UPPER, -1.0)}[stop]
    for share, carried in ((0.99, True), (1.01, False)):
        watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
        watched.position[axis] = end[axis] + way * share * near
        assert observer.supported(watched.block[0], axis) is carried


@pytest.mark.parametrize('axis', [X, Z])
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_into_a_stop_the_model_goes_no_way_but_out_of_it(axis: int, side: float) -> None:
    for off, towards, goes in ((1.5e-4, 1.0, False), (1.5e-4, -1.0, True), (2.5e-4, 1.0, True)):
        watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
        watched.position[axis] = side * (UPPER[axis] - off)
        watched.model_rate[axis] = side * towards * 0.1
        observer.predict(watched.block[0], np.zeros(12))
        supported = off < 2e-4  # by which it may be held whatever pushes
        assert bool(watched.least_rate[axis] != 0.0) is (goes and not supported)


def told(innovation: np.ndarray, used: Flags) -> np.ndarray:
    """y, phi, theta that the believed gaps tell by the geometry, tilts small, NaN: nothing."""
    r = MACHINE.r
    rows = np.array([[1.0, -r, 0.0], [1.0, 0.0, r], [1.0, r, 0.0], [1.0, 0.0, -r]])
    pairs = int(used[0]) + int(used[2]), int(used[1]) + int(used[3])
    columns = [0]
    if pairs[0] == 2 or (pairs[0] == 1 and pairs[1] == 2):
        columns.append(1)
    if pairs[1] == 2 or (pairs[1] == 1 and pairs[0] > 0):
        columns.append(2)
    which = np.flatnonzero(used[:4])
    answer = np.full(3, np.nan)
    if len(which):
        part = rows[np.ix_(which, columns)]
        answer[columns] = np.linalg.lstsq(part, innovation[which], rcond=None)[0]
    return answer


@settings(max_examples=200)
@given(off=st.tuples(*[st.floats(-1e-4, 1e-4)] * 6).map(np.array), used=flags, counted=flags)
def test_what_the_encoders_tell_corrects_by_the_observers_gains(
    off: np.ndarray, used: np.ndarray, counted: np.ndarray
) -> None:
    """As least squares have it, over what the gaps that are believed can tell.

    Three poles: 1 - p³ of it is taken for position, and so on. A gap that stands still tells only
    that its count has not changed.
    """
    watched = watched_at(np.zeros(5), np.full(5, 0.01), np.full(5, 0.1))
    watched.acceleration[:] = 100.0  # of which no friction stops what coasts
    watched.model_rate[:], watched.still_time[:], watched.disturbance_then[:] = 7.0, 8.0, 9.0
    watched.least_rate[:], watched.length[:] = 6.0, lengths(watched.position)
    before = watched.position.copy()
    observer.correct(watched.block[0], watched.length + off, used, counted)
    count = np.array(PARAMETERS.encoder.resolution)
    still = np.sign(off) * np.maximum(np.abs(off) - count, 0.0)
    news = np.where(counted, off, still)
    y, phi, theta = told(news, used)
    error = np.array([y, *np.where(used[4:], news[4:], np.nan), phi, theta])
    error[np.isnan(error)] = 0.0
    gains = (
        1.0 - POLE**3,
        1.5 * (1.0 - POLE) ** 2 * (1.0 + POLE) / T,
        (1.0 - POLE) ** 3 / T**2,
    )
    np.testing.assert_allclose(watched.position - before, gains[0] * error, atol=1e-12)
    np.testing.assert_allclose(watched.rate - 0.01, gains[1] * error, atol=1e-9)
    np.testing.assert_allclose(watched.disturbance - 0.1, gains[2] * error, atol=1e-6)
    z, x = counted[0] or counted[2], counted[1] or counted[3]
    heard = np.array([z or x, counted[4], counted[5], z, x])
    np.testing.assert_array_equal(watched.model_rate, np.where(heard, watched.rate, 7.0))
    np.testing.assert_array_equal(watched.still_time, np.where(heard, 0.0, 8.0))
    expected = np.where(heard, watched.disturbance, 9.0)
    np.testing.assert_array_equal(watched.disturbance_then, expected)
    np.testing.assert_array_equal(watched.least_rate, np.where(heard, 0.0, 6.0))


@pytest.mark.parametrize('rises_at', [np.nan, -0.7, 0.4])
def test_what_rests_is_off_by_what_it_rises_at(rises_at: float) -> None:
    watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
    watched.rises_at, watched.rested = rises_at, np.isnan(rises_at)
    watched.disturbance[:] = watched.disturbance_then[:] = 3.0
    observer.rest(watched.block[0])
    known = not np.isnan(rises_at)
    assert bool(watched.rested) is known
    for array in (watched.disturbance, watched.disturbance_then):
        assert array.tolist() == [-rises_at if known else 3.0, 3.0, 3.0, 3.0, 3.0]


def test_on_the_lower_stop_its_support_is_no_disturbance() -> None:
    watched = watched_at(np.array([1.0, 0.0, 0.0, 0.0, 0.0]), np.zeros(5), np.zeros(5))
    watched.length[:] = lengths(watched.position)
    off = np.array([1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 6e-5])
    observer.correct(watched.block[0], watched.length + off, np.ones(6, bool), np.ones(6, bool))
    assert not watched.disturbance[[Y, PHI, THETA]].any()
    assert watched.disturbance[[X, Z]].all()
    assert watched.rate.all()


@pytest.mark.parametrize('axis', [X, Z])
@pytest.mark.parametrize(
    ('rate', 'acceleration', 'rests'),
    [
        (0.001, -0.2, False),  # it has not turned round
        (-0.001, -0.2, False),
        (0.001, 0.2, False),
        (-0.0001, -0.2, True),
        (0.0001, 0.2, True),
        (0.0, -0.2, True),
        (-0.0001, -0.4, False),  # friction does not hold it
        (0.0001, 0.4, False),
    ],
)
def test_what_nothing_shows_rests_where_it_turns_round(
    axis: int, rate: float, acceleration: float, rests: bool
) -> None:
    watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
    watched.length[:] = lengths(watched.position)
    watched.rate[:], watched.acceleration[:], watched.disturbance[:] = rate, acceleration, 0.05
    used = np.arange(6) != 3 + axis
    observer.correct(watched.block[0], watched.length.copy(), used, np.zeros(6, bool))
    assert bool(watched.rate[axis] == 0.0 and watched.disturbance[axis] == 0.0) is (
        rests or rate == 0.0
    )
    other = X + Z - axis
    assert watched.rate[other] == rate


def test_it_begins_at_rest_and_knows_nothing() -> None:
    watched = watched_at(np.full(5, 0.1), np.ones(5), np.ones(5))
    position = watched.position + 1e-4
    for unknown in (
        watched.model_rate,
        watched.least_rate,
        watched.disturbance_then,
        watched.still_time,
    ):
        unknown[:] = 1.0
    observer.start(watched.block[0], lengths(position))
    np.testing.assert_allclose(watched.position, position, rtol=1e-9)
    for unknown in (
        watched.rate,
        watched.disturbance,
        watched.model_rate,
        watched.least_rate,
        watched.disturbance_then,
        watched.still_time,
    ):
        assert not unknown.any()


@pytest.mark.parametrize('axis', range(5))
def test_of_what_nothing_shows_only_friction_is_believed_and_of_a_tilt_nothing(axis: int) -> None:
    for pushed in (-9.0, -0.1, 0.1, 9.0):
        watched = watched_at(np.zeros(5), np.zeros(5), np.full(5, pushed))
        observer.bound_disturbance(watched.block[0], axis)
        bound = FRICTION[axis] if axis < PHI else 0.0
        expected = np.full(5, pushed)
        expected[axis] = np.clip(pushed, -bound, bound)
        np.testing.assert_array_equal(watched.disturbance, expected)


@pytest.mark.parametrize('axis', range(5))
def test_taken_alone_an_axis_moves_as_the_model_says(axis: int) -> None:
    watched = watched_at(np.zeros(5), np.ones(5), np.ones(5))
    watched.model_rate[:], watched.disturbance_then[:] = 3.0, 4.0
    observer.alone(watched.block[0], axis)
    assert watched.rate.tolist() == np.where(np.arange(5) == axis, 3.0, 1.0).tolist()
    assert watched.disturbance.tolist() == np.where(np.arange(5) == axis, 4.0, 1.0).tolist()


@pytest.mark.parametrize('axis', [X, Z])
def test_taken_at_its_word_it_rests_where_it_reads_and_pushed_as_it_was(axis: int) -> None:
    """What held it meanwhile was friction: of what pushed before no more is believed."""
    for pushed in (-9.0, -0.1, 0.1, 9.0):
        watched = watched_at(np.zeros(5), np.ones(5), np.full(5, 5.0))
        watched.disturbance_then[axis] = pushed
        observer.take_at_its_word(watched.block[0], axis, 1e-3)
        expected = np.full(5, 5.0)
        expected[axis] = np.clip(pushed, -FRICTION[axis], FRICTION[axis])
        np.testing.assert_array_equal(watched.disturbance, expected)
        assert watched.rate.tolist() == [float(other != axis) for other in range(5)]
        assert watched.position[axis] == watched.length[3 + axis] == 1e-3


@pytest.mark.parametrize('axis', [X, Z])
def test_a_bound_that_is_just_reached_is_not_yet_passed(axis: int) -> None:
    """To the last bit: near a stop, and what friction just does not hold."""
    watched = watched_at(np.zeros(5), np.zeros(5), np.zeros(5))
    watched.lower[axis], watched.upper[axis], watched.position[axis] = -2e-4, 1.0, 0.0
    assert not observer.supported(watched.block[0], axis)
    watched.model_rate[axis], watched.friction[axis] = -1.0, 0.0
    observer.predict(watched.block[0], np.zeros(12))
    assert watched.least_rate[axis] < 0.0
    watched.length[:] = lengths(watched.position)
    watched.rate[axis], watched.acceleration[axis], watched.friction[axis] = -1e-4, -0.25, 0.25
    used = np.arange(6) != 3 + axis
    observer.correct(watched.block[0], watched.length.copy(), used, np.zeros(6, bool))
    assert watched.rate[axis] != 0.0
