"""Encoders that stand still: what they should have done meanwhile, and what speaks against them."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import MACHINE, PARAMETERS, hovering
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_hw_bridge.sensing.guard_arrays import LOST, NOISY, PUT_RIGHT, SOUND, GuardArrays
from maglev_hw_bridge.sensing.standing_still import (
    CONTRADICTED,
    UNSEEN,
    find_stuck,
    follow_model,
    listen,
    look,
    lose,
)
from maglev_model.axes import PHI, THETA, X, Y, Z

T = PARAMETERS.sample_time
STOP = PARAMETERS.machine.gap_max

five = st.tuples(*[st.floats(-1.0, 1.0)] * 5).map(np.array)

LONG = 1000  # samples


def looked(watched: GuardArrays, *, flying: bool = True) -> np.ndarray:
    """Which encoders counted."""
    counted = np.zeros(6, bool)
    look(watched.block[0], flying, counted)
    return counted


# -- how far they should have moved ----------------------------------------------------------------


@settings(max_examples=60)
@given(rate=five, before=st.tuples(*[st.floats(-1e-5, 1e-5)] * 6).map(np.array))
def test_what_stands_still_should_have_moved_as_the_geometry_has_it(
    rate: np.ndarray, before: np.ndarray
) -> None:
    """By (5), tilts small, by the rate that the model alone leaves each axis at least."""
    watched = hovering()
    watched.least_rate[:], watched.unseen[:] = rate, before
    assert not looked(watched).any()
    r, (y, x, z, phi, theta) = MACHINE.r, rate
    moved = T * np.array([y - r * phi, y + r * theta, y + r * phi, y - r * theta, x, z])
    at_rest = np.array(
        [y == phi == 0.0, y == theta == 0.0, y == phi == 0.0, y == theta == 0.0, x == 0.0, z == 0.0]
    )
    np.testing.assert_allclose(watched.unseen, np.where(at_rest, 0.0, before + moved), atol=1e-15)


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize(
    'why', ['it counts', 'on the ground', 'not settled', 'held', 'near the stop, one gap lost']
)
def test_but_not_where_it_may_stand_still(encoder: int, why: str) -> None:
    watched = hovering()
    watched.least_rate[:], watched.unseen[:] = 0.1, 1e-5
    if why == 'it counts':
        watched.past[0, encoder] -= 1e-5
    if why == 'not settled':
        watched.samples = watched.settling - 1
    if why == 'held':
        watched.least_rate[:] = 0.0
    if why.startswith('near'):
        watched.rigid = False
        watched.position[Y] = STOP - 0.9e-3
    counted = looked(watched, flying=why != 'on the ground')
    assert counted.tolist() == [i == encoder and why == 'it counts' for i in range(6)]
    goes_on = why.startswith('near') and encoder >= 4
    assert bool(watched.unseen[encoder] > 1e-5) is goes_on
    assert goes_on or watched.unseen[encoder] == 0.0


@pytest.mark.parametrize(('rigid', 'below'), [(True, 0.9e-3), (False, 1.1e-3)])
def test_higher_up_or_with_four_gaps_near_the_stop_too_a_gap_must_move(
    rigid: bool, below: float
) -> None:
    watched = hovering()
    watched.least_rate[Y] = 0.1
    watched.rigid, watched.position[Y] = rigid, STOP - below
    looked(watched)
    np.testing.assert_allclose(watched.unseen[:4], 1e-4)


@pytest.mark.parametrize('encoder', range(4))
def test_a_gap_stands_still_where_friction_holds_y_and_its_own_tilt(encoder: int) -> None:
    for axis in (PHI, THETA):
        watched = hovering()
        watched.least_rate[axis], watched.unseen[:] = 0.1, 1e-5
        looked(watched)
        own = PHI if encoder % 2 == 0 else THETA
        assert bool(watched.unseen[encoder] == 0.0) is (axis != own)


def test_a_bound_that_is_just_reached_is_not_yet_passed() -> None:
    """To the last bit: near the stop, missed by x and z, fast, stuck, and contradicted."""
    watched = hovering()
    watched.least_rate[Y] = 0.1
    watched.rigid, watched.position[Y] = False, watched.upper[Y] - 1e-3
    looked(watched)
    assert (watched.unseen[:4] > 0.0).all()
    watched = hovering()
    watched.unseen[4], watched.position[X], watched.past[0, 4] = 2.5e-5, 3e-3, -1e-5
    looked(watched)
    assert watched.position[X] == 3e-3
    watched = hovering()
    lose(watched.block[0], 4)
    watched.heard[0], watched.read[0], watched.believed[4] = 4, 0.0, 5e-4
    listen(watched.block[0])
    assert watched.returned
    for encoder in range(6):
        watched = hovering()
        watched.unseen[encoder] = watched_limit(encoder)
        assert not find_stuck(watched.block[0], np.arange(6) == encoder, UNSEEN)
    watched = hovering()
    watched.residual_then[1], watched.still[1] = 0.5 * PARAMETERS.fault.stuck_gap, LONG
    assert not find_stuck(watched.block[0], np.arange(6) == 1, CONTRADICTED)


def test_a_contradiction_that_is_older_than_its_last_count_says_nothing() -> None:
    watched = hovering()
    watched.believed[0] += 1e-4
    watched.residual_then[:], watched.still[:] = 1e-4, LONG
    assert not find_stuck(watched.block[0], np.arange(6) == 1, CONTRADICTED)


def test_one_that_is_lost_counts_no_more() -> None:
    watched = hovering()
    watched.past[0] -= 1e-5
    watched.trust[:] = [LOST, PUT_RIGHT, SOUND, LOST, NOISY, LOST]
    assert looked(watched).tolist() == [False, True, True, False, True, False]


@pytest.mark.parametrize('rigid', [True, False])
def test_the_contradiction_is_remembered_since_a_gap_counted(rigid: bool) -> None:
    watched = hovering()
    watched.rigid = rigid
    watched.believed[0] += 4e-5
    watched.residual_then[:] = 7.0
    watched.still[:] = 7
    looked(watched)
    np.testing.assert_allclose(watched.residual_then, [4e-5] + [7.0 if rigid else 4e-5] * 3)
    assert watched.still.tolist() == [0] + [8 if rigid else 0] * 3


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize(
    'why', ['', 'it counts', 'on the ground', 'not settled', 'lost', 'on the stop']
)
def test_how_long_an_encoder_has_been_silent_in_flight(encoder: int, why: str) -> None:
    watched = hovering()
    watched.silent[:] = 5
    if why == 'it counts':
        watched.past[0, encoder] -= 1e-5
    if why == 'not settled':
        watched.samples = watched.settling - 1
    if why == 'lost':
        watched.trust[encoder] = LOST
    if why == 'on the stop':
        watched.position[Y] = STOP
    looked(watched, flying=why != 'on the ground')
    assert watched.silent[encoder] == (0 if why else 6)


def test_probation_passes() -> None:
    watched = hovering()
    watched.probation[:] = [3, 2, 1, 0, 1, 0]
    looked(watched)
    assert watched.probation.tolist() == [2, 1, 0, 0, 0, 0]


@pytest.mark.parametrize('encoder', [4, 5])
@pytest.mark.parametrize('unseen', [2.4e-5, -2.4e-5, 2.6e-5, -2.6e-5])
def test_what_counts_after_it_was_missed_is_where_it_says(encoder: int, unseen: float) -> None:
    watched = hovering()
    axis = encoder - 3
    watched.unseen[encoder], watched.position[axis], watched.rate[axis] = unseen, 3e-3, 0.1
    watched.past[0, encoder] -= 1e-5
    looked(watched)
    taken = abs(unseen) > 2.5e-5
    assert watched.position[axis] == (0.0 if taken else 3e-3)
    assert watched.rate[axis] == (0.0 if taken else 0.1)


# -- who is stuck ----------------------------------------------------------------------------------


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_doubted_for_too_long_it_is_stuck(encoder: int, way: float) -> None:
    largest = watched_limit(encoder)
    for share, doubtful, stuck in ((0.99, True, False), (1.01, True, True), (1.01, False, False)):
        watched = hovering()
        watched.disturbance[:] = 9.0
        watched.unseen[encoder] = way * share * largest
        watched.residual_then[:] = largest  # which four gaps show too
        doubted = (np.arange(6) == encoder) & doubtful
        assert find_stuck(watched.block[0], doubted, UNSEEN) is stuck
        assert watched.trust.tolist() == [LOST * (stuck and i == encoder) for i in range(6)]
        assert watched.blamed.tolist() == [int(stuck and i == encoder) for i in range(6)]
        assert bool(watched.disturbance[PHI] == 0.0) is stuck
        assert bool(watched.disturbance[THETA] == 0.0) is stuck
        for k, axis in ((4, X), (5, Z)):
            gone = stuck and encoder == k
            bounded = PARAMETERS.fault.friction[axis] if gone else 9.0
            assert watched.disturbance[axis] == bounded
            assert watched.stood[k - 4] == int(gone)


def watched_limit(encoder: int) -> float:
    """How far an encoder may be missed [m]."""
    fault = PARAMETERS.fault
    return fault.stuck_gap if encoder < 4 else fault.stuck_horizontal


@pytest.mark.parametrize(
    ('unseen', 'shown', 'rigid', 'stuck'),
    [
        ((82e-6, -23e-6, 83e-6, 201e-6), 0.0, True, []),
        ((82e-6, -23e-6, 83e-6, 201e-6), 99e-6, True, []),
        ((82e-6, -23e-6, 83e-6, 201e-6), 102e-6, True, [3]),
        ((82e-6, -23e-6, 83e-6, 201e-6), 0.0, False, [3]),
        ((201e-6, -23e-6, 201e-6, 420e-6), 0.0, True, [0, 2, 3]),
        ((201e-6, -23e-6, 199e-6, 290e-6), 0.0, True, [0, 3]),
        ((201e-6, -23e-6, 199e-6, 305e-6), 0.0, True, []),
    ],
)
@pytest.mark.parametrize('x', [False, True])
def test_one_of_several_is_not_done_without_where_four_gaps_deny_that_it_alone_is_stuck(
    unseen: tuple[float, ...], shown: float, rigid: bool, stuck: list[int], x: bool
) -> None:
    """As where a phase is dead and the platen hangs still within a count for a while."""
    watched = hovering()
    watched.rigid, watched.unseen[:4], watched.residual_then[:] = rigid, unseen, shown
    watched.unseen[4] = 1.01 * watched_limit(4) * x
    doubted = np.abs(watched.unseen) > 2.5e-5
    wanted = stuck + [4] * x
    assert find_stuck(watched.block[0], doubted, UNSEEN) is bool(wanted)
    assert np.flatnonzero(watched.blamed).tolist() == wanted
    assert np.flatnonzero(watched.trust == LOST).tolist() == wanted


@pytest.mark.parametrize('share', [0.49, 0.51])
def test_of_gaps_that_contradict_each_other_half_of_that_is_enough(share: float) -> None:
    watched = hovering()
    watched.unseen[:] = 0.0
    watched.residual_then[1], watched.still[1] = share * PARAMETERS.fault.stuck_gap, LONG
    assert find_stuck(watched.block[0], np.arange(6) == 1, CONTRADICTED) is (share > 0.5)
    assert bool(watched.trust[1] == LOST) is (share > 0.5)


@pytest.mark.parametrize('enough', [False, True])
def test_what_contradicts_by_more_than_a_platen_moves_since_a_count_is_a_leap_of_another(
    enough: bool,
) -> None:
    """Which is at most 35 mm/s: a sound gap encoder may well not count in two samples."""
    watched = hovering()
    watched.unseen[:], watched.residual_then[1] = 0.0, 1.42e-4
    watched.still[1] = int(1.42e-4 / (0.035 * watched.period)) + enough
    assert find_stuck(watched.block[0], np.arange(6) == 1, CONTRADICTED) is enough
    assert bool(watched.trust[1] == LOST) is enough


@pytest.mark.parametrize('encoder', [4, 5])
def test_x_and_z_are_stuck_by_what_they_should_have_moved_whatever_gaps_say(encoder: int) -> None:
    watched = hovering()
    watched.unseen[encoder] = 1.01 * watched_limit(encoder)
    assert find_stuck(watched.block[0], np.arange(6) == encoder, CONTRADICTED)
    assert watched.trust[encoder] == LOST


def test_one_that_leapt_and_is_doubted_is_done_without_too() -> None:
    watched = hovering()
    watched.blamed[2] = watched.blamed[3] = 1
    assert not find_stuck(watched.block[0], np.arange(6) == 2, UNSEEN)
    assert watched.trust.tolist() == [SOUND, SOUND, LOST, SOUND, SOUND, SOUND]


def test_lost_x_and_z_remember_that_they_stood_still() -> None:
    for encoder in range(6):
        watched = hovering()
        watched.heard[:] = 3
        lose(watched.block[0], encoder)
        assert watched.trust.tolist() == [LOST * (i == encoder) for i in range(6)]
        assert watched.stood.tolist() == [int(encoder == 4), int(encoder == 5)]
        assert watched.heard.tolist() == [3 * (encoder != 4), 3 * (encoder != 5)]


# -- who comes back --------------------------------------------------------------------------------


def heard(steps: list[float], encoder: int) -> tuple[GuardArrays, list[bool]]:
    """What becomes of a lost x or z that reads on in such steps."""
    watched = hovering()
    lose(watched.block[0], encoder)
    returned = []
    for step in steps:
        watched.believed[encoder] += step
        listen(watched.block[0])
        returned.append(watched.returned)
    return watched, returned


@pytest.mark.parametrize('encoder', [4, 5])
@pytest.mark.parametrize('way', [-1.0, 1.0])
@pytest.mark.parametrize(
    ('counts', 'comes'),
    [
        ([1, 1, 1, 1, 1], True),
        ([1, 0, 1, 0, 0, 1, 1, 1], True),
        ([1, 1, 1, 1, 0], False),
        ([1, 1, 1, 1, -1, 1], False),
        ([-1, -1, 1, 1, 1, 1, 1], True),
        ([1, 1, 1, 1, 51], False),  # faster than anything: from here anew
        ([51, 1, 1, 1, 1], True),
        ([49, 1, 1, 1, 1], True),
        ([1, 1, 1, 1, 49], True),
    ],
)
def test_five_counts_one_way_bring_it_back(
    encoder: int, way: float, counts: list[int], comes: bool
) -> None:
    watched, returned = heard([1e-5 * way * count for count in counts], encoder)
    assert returned == [False] * (len(counts) - 1) + [comes]
    assert watched.trust[encoder] == (PUT_RIGHT if comes else LOST)
    assert watched.stood[encoder - 4] == int(not comes)
    listen(watched.block[0])
    assert not watched.returned
    if comes:
        before = watched.believed[encoder] - 1e-5 * way * counts[-1]
        assert watched.past[:, encoder] == pytest.approx(before)
        assert watched.position[encoder - 3] == pytest.approx(before)


@pytest.mark.parametrize('encoder', [4, 5])
def test_what_was_lost_otherwise_stays_lost(encoder: int) -> None:
    watched = hovering()
    watched.trust[encoder] = LOST
    for _ in range(10):
        watched.believed[encoder] += 1e-5
        listen(watched.block[0])
        assert not watched.returned
    assert watched.trust[encoder] == LOST


# -- what nobody shows -----------------------------------------------------------------------------


@settings(max_examples=64)
@given(
    doubted=st.tuples(*[st.booleans()] * 6).map(np.array),
    used=st.tuples(*[st.booleans()] * 6).map(np.array),
)
def test_what_no_encoder_shows_moves_as_the_model_alone_says(
    doubted: np.ndarray, used: np.ndarray
) -> None:
    watched = hovering()
    watched.rate[:], watched.model_rate[:] = 1.0, 2.0
    watched.disturbance[:], watched.disturbance_then[:] = 3.0, 4.0
    follow_model(watched.block[0], doubted, used)
    alone = doubted[:4].any() and not used[:4].any()
    expected = np.array([alone, doubted[4], doubted[5], alone, alone])
    np.testing.assert_array_equal(watched.rate, np.where(expected, 2.0, 1.0))
    np.testing.assert_array_equal(watched.disturbance, np.where(expected, 4.0, 3.0))


@pytest.mark.parametrize('one', range(4))
def test_one_gap_is_enough_to_doubt_y_and_one_to_show_it(one: int) -> None:
    gap, none = np.arange(6) == one, np.zeros(6, bool)
    for doubted, used, alone in ((gap, none, True), (~gap, gap, False), (none, none, False)):
        watched = hovering()
        watched.model_rate[:] = 2.0
        follow_model(watched.block[0], doubted, used)
        assert bool(watched.rate[Y] == 2.0) is alone
