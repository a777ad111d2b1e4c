"""The judge of the encoders by itself: what tells of what, and who is at rest."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard, guard_arrays, observer
from maglev_hw_bridge.sensing.standing_still import call_the_roll, look
from maglev_model.axes import PHI, THETA, X, Y, Z
from maglev_model.machine import machine_constants
from maglev_model.platen import output_accelerations

PARAMETERS = BridgeParameters()


@pytest.mark.parametrize(
    ('encoder', 'told'),
    [(0, {Y, PHI}), (1, {Y, THETA}), (2, {Y, PHI}), (3, {Y, THETA}), (4, {X}), (5, {Z})],
)
def test_a_count_tells_only_of_the_axes_that_move_its_encoder(encoder: int, told: set[int]) -> None:
    watched = guard.Guard(PARAMETERS).arrays
    length = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    record = watched.block[0]
    observer.start(record, length)
    watched.still_time[:] = 0.01
    counted = np.arange(6) == encoder
    observer.correct(record, length, np.ones(6, np.bool_), counted)
    assert set(np.flatnonzero(watched.still_time == 0.0)) == told


@pytest.mark.parametrize('used', [(0, 1, 2, 3), (0, 2), (1, 3), (1, 2, 3), (0, 1), (2,), (3,)])
def test_y_follows_the_gaps_by_the_same_share_however_many_are_believed(
    used: tuple[int, ...],
) -> None:
    """Of three poles at 200 1/s after 1 ms, where all that are believed read 0.1 mm more."""
    watched = guard.Guard(PARAMETERS).arrays
    length = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    observer.start(watched.block[0], length)
    watched.length[:] = length
    length[:4] += 1e-4
    believed = np.isin(np.arange(6), used)
    observer.correct(watched.block[0], length, believed, np.ones(6, np.bool_))
    share = 1.0 - np.exp(-3.0 * PARAMETERS.fault.bandwidth * PARAMETERS.sample_time)
    assert watched.position[Y] - 0.025 == pytest.approx(share * 1e-4)
    assert watched.position[[PHI, THETA]] == pytest.approx([0.0, 0.0], abs=1e-12)


def pull_of_tilt(theta: float) -> float:
    """Acceleration of theta at 25 mm, without current [rad/s^2]."""
    machine, none = machine_constants(PARAMETERS.machine), np.zeros(4)
    return output_accelerations(machine, 0.025, 0.0, theta, none, none)[THETA]


@pytest.mark.parametrize(
    ('then', 'pushed', 'held'),
    [(-2.0, -4.9, True), (-2.0, -5.1, False), (-4.0, -5.9, True), (-4.0, -6.1, False),
     (0.0, -2.9, True), (2.0, -3.1, False)],
)  # fmt: skip
def test_what_friction_may_have_been_can_turn(then: float, pushed: float, held: bool) -> None:
    """What pushed along at the last count, up to the bound of 3 rad/s^2, may hold as well."""
    watched = guard.Guard(PARAMETERS).arrays
    record = watched.block[0]
    observer.start(record, np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0]))
    watched.disturbance_then[THETA] = then
    watched.position[THETA] = 1e-3 * (pushed - then) / pull_of_tilt(1e-3)
    for _ in range(3):
        observer.predict(record, np.zeros(12))
    assert bool(watched.least_rate[THETA] == 0.0) is held


def test_what_begins_on_its_stop_rests_whatever_noise_says() -> None:
    """As speed it would be braked, and so the platen thrown off the stop that it rests on."""
    judge, stop = guard.Guard(PARAMETERS), PARAMETERS.machine.gap_max
    length = np.array([stop, stop, stop, stop, 0.0, 0.0])
    for noise in (6.9e-4, 3.2e-4):
        length[3] = stop + noise
        code, index = judge.watch(length, np.zeros(12), False)
    assert (code, index) == (guard.JUMP, 3)
    assert np.all(judge.arrays.rate == 0.0)


@pytest.mark.parametrize(
    ('encoder', 'away'), [(0, -0.8), (1, 0.03), (3, 0.03), (4, 0.47), (5, -0.1)]
)
def test_what_begins_where_no_platen_can_be_has_lost_its_count(encoder: int, away: float) -> None:
    judge, stop = guard.Guard(PARAMETERS), PARAMETERS.machine.gap_max
    length = np.array([stop, stop, stop, stop, 0.0, 0.0])
    length[encoder] += away
    assert judge.watch(length, np.zeros(12), False) == (guard.JUMP, encoder)
    assert judge.failed == [encoder]


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize(('beyond', 'possible'), [(9.9e-3, True), (10.1e-3, False)])
def test_a_centimetre_beyond_its_stop_it_may_be_tilts_and_all(
    encoder: int, beyond: float, possible: bool
) -> None:
    judge, machine = guard.Guard(PARAMETERS), PARAMETERS.machine
    length = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    axis = 0 if encoder < 4 else encoder - 3
    for end, way in ((machine.lower_limit[axis], -1.0), (machine.upper_limit[axis], 1.0)):
        judge.trust()
        there = length.copy()
        there[encoder] = end + way * beyond
        judge.watch(there, np.zeros(12), False)
        assert judge.failed == ([] if possible else [encoder])


def test_what_makes_no_place_at_all_is_begun_anew_until_it_does() -> None:
    """Gaps that differ by more than the platen is long give no tilt."""
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    for away in (0.8, 0.0, 0.0):
        judge.watch(length + away * np.array([0, 1, 0, -1, 0, 0]), np.zeros(12), True)
        assert np.isfinite(judge.arrays.position).all() == (away == 0.0)
    assert judge.arrays.position == pytest.approx([0.025, 0.0, 0.0, 0.0, 0.0])
    assert np.all(judge.arrays.rate == 0.0)


def test_what_four_gaps_contradict_each_other_by_is_told_as_it_was_read() -> None:
    judge = guard.Guard(PARAMETERS)
    for off in (0.0, 3e-5, -1e-5):
        length = np.array([0.025 + off, 0.0251, 0.0252, 0.0249, 0.0, 0.0])
        judge.watch(length, np.zeros(12), False)
        assert judge.residual == pytest.approx(2e-4 + off, abs=1e-12)


def test_what_begins_aloft_moves_as_it_is_read() -> None:
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    for _ in range(2):
        code, _ = judge.watch(length, np.zeros(12), True)
        assert code == guard.FINE
        length[:4] -= 1e-5
        length[5] += 2e-5
    assert judge.arrays.rate == pytest.approx([-0.01, 0.0, 0.02, 0.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(('current', 'found'), [(0.02, []), (1.0, [4])])
def test_x_is_missed_near_the_lower_stop_too_when_a_gap_is_lost(
    current: float, found: list[int]
) -> None:
    """There the landing would go on pushing a platen that it cannot see."""
    judge, amplifiers = guard.Guard(PARAMETERS), Amplifiers(PARAMETERS)
    y = PARAMETERS.machine.gap_max - 5e-4
    length = np.array([y, y, y, y, 0.0, 0.0])
    judge.arrays.trust[0] = guard_arrays.LOST
    amplifiers.drive(np.zeros(4), np.array([0.0, current, 0.0, current]), 0.0, 0.0)
    blamed: list[int] = []
    for _ in range(300):
        judge.watch(length, amplifiers.arrays.current, True)
        blamed += judge.blamed
    assert blamed == found


@pytest.mark.parametrize('rate', [0.0, 0.05, -0.1])
@pytest.mark.parametrize('along', [X, Z])
def test_what_may_be_held_has_moved_no_way_unseen(along: int, rate: float) -> None:
    """Before friction held it, it may have gone as far as less than a count."""
    watched = guard.Guard(PARAMETERS).arrays
    watched.samples = watched.settling
    watched.least_rate[along], watched.unseen[3 + along] = rate, 2e-5
    look(watched.block[0], True, np.zeros(6, np.bool_))
    unseen = 2e-5 + rate * PARAMETERS.sample_time if rate else 0.0
    assert watched.unseen[3 + along] == pytest.approx(unseen, abs=1e-15)


@pytest.mark.parametrize(('y', 'answered'), [(PARAMETERS.machine.gap_max, 0), (0.025, 1)])
def test_each_lift_off_calls_the_roll_anew(y: float, answered: int) -> None:
    """Who answered before has not answered this one; in the air nobody is called."""
    watched = guard.Guard(PARAMETERS).arrays
    observer.start(watched.block[0], np.array([y, y, y, y, 0.0, 0.0]))
    watched.answered[:], watched.left[:] = 1 - answered, 1e-4
    assert not call_the_roll(watched.block[0], False, np.zeros(6, np.bool_))
    assert np.all(watched.answered == answered)
    assert np.all(watched.left == 0.0)


@pytest.mark.parametrize('along', [X, Z])
def test_what_stands_still_moves_as_fast_as_it_is_pushed_since_it_counted(along: int) -> None:
    """Nor is it thought to be braked by what it read while nobody doubted it yet."""
    judge, amplifiers = guard.Guard(PARAMETERS), Amplifiers(PARAMETERS)
    length = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    watched, i_q = judge.arrays, np.zeros(4)
    for _ in range(200):
        judge.watch(length, np.zeros(12), True)
        watched.position[0], watched.rate[0], watched.disturbance[0] = 0.025, 0.0, 0.0
    i_q[2 - along :: 2] = 0.3
    amplifiers.drive(np.zeros(4), i_q, 0.0, 0.0)
    machine, none = machine_constants(PARAMETERS.machine), np.zeros(4)
    push = output_accelerations(machine, 0.025, 0.0, 0.0, none, i_q)[along]
    samples = 0
    while judge.blamed == []:
        judge.watch(length, amplifiers.arrays.current, True)
        watched.position[0], watched.rate[0], watched.disturbance[0] = 0.025, 0.0, 0.0
        samples += 1
        if abs(watched.unseen[3 + along]) > 3e-5 and judge.blamed == []:
            assert watched.rate[along] == pytest.approx(1e-3 * samples * push, rel=1e-3)
            assert watched.disturbance[along] == pytest.approx(0.0, abs=1e-3)
    assert judge.blamed == [3 + along]


def test_gaps_that_all_stand_still_leave_y_to_the_magnets() -> None:
    """Without current from 25 mm: as fast as those pull it up since the gaps counted last."""
    judge, machine = guard.Guard(PARAMETERS), machine_constants(PARAMETERS.machine)
    length, none = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0]), np.zeros(4)
    watched = judge.arrays
    for _ in range(200):
        judge.watch(length, np.zeros(12), False)
        watched.position[Y], watched.rate[Y], watched.disturbance[Y] = 0.025, 0.0, 0.0
        watched.model_rate[Y] = watched.still_time[Y] = 0.0
    y, speed = 0.025, 0.0
    while judge.blamed == []:
        judge.watch(length, np.zeros(12), True)
        speed += 1e-3 * output_accelerations(machine, y, 0.0, 0.0, none, none)[Y]
        y += 1e-3 * speed
        if abs(watched.unseen[0]) > 3e-5 and judge.blamed == []:
            assert watched.rate[Y] == pytest.approx(speed, rel=0.02)
            assert watched.disturbance[Y] == pytest.approx(0.0, abs=1e-3)
    assert judge.blamed == [0, 1, 2, 3]


@pytest.mark.parametrize('along', [X, Z])
@pytest.mark.parametrize('pushed', [-2.0, -0.3, 0.3, 2.0])
def test_no_more_than_friction_is_believed_to_push_what_nothing_shows(
    along: int, pushed: float
) -> None:
    """As after noise, that lost it while something else seemed to push it [m/s²]."""
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    for _ in range(3):
        judge.watch(length, np.zeros(12), True)
    judge.arrays.trust[3 + along] = guard_arrays.LOST
    judge.arrays.disturbance[along] = pushed
    judge.arrays.rate[along] = 0.1  # it does not come to rest in this sample
    judge.watch(length, np.zeros(12), True)
    friction = PARAMETERS.fault.friction[along]
    assert judge.arrays.disturbance[along] == pytest.approx(np.clip(pushed, -friction, friction))


@pytest.mark.parametrize('along', [X, Z])
def test_what_was_lost_and_counts_again_is_where_it_says_and_slow(along: int) -> None:
    judge, length = guard.Guard(PARAMETERS), np.array([0.031, 0.031, 0.031, 0.031, 0.0, 0.0])
    for _ in range(4):
        judge.watch(length, np.zeros(12), False)
    judge.lose(3 + along)
    judge.arrays.position[along] = 3e-3  # where the model has carried it meanwhile
    while not judge.returned:
        length[3 + along] -= 1e-5
        judge.watch(length, np.zeros(12), False)
    assert judge.arrays.position[along] == pytest.approx(length[3 + along], abs=1e-5)
    assert abs(judge.arrays.rate[along]) < 0.01


def test_x_that_counts_after_all_is_taken_at_its_word() -> None:
    """What was held is not thrown about by how far the model has gone without it."""
    judge, amplifiers = guard.Guard(PARAMETERS), Amplifiers(PARAMETERS)
    length = np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    watched = judge.arrays
    for _ in range(200):
        judge.watch(length, np.zeros(12), True)
        watched.position[0], watched.rate[0], watched.disturbance[0] = 0.025, 0.0, 0.0
    amplifiers.drive(np.zeros(4), np.array([0.0, 0.3, 0.0, 0.3]), 0.0, 0.0)
    while abs(watched.unseen[4]) < 8e-5:
        judge.watch(length, amplifiers.arrays.current, True)
        assert judge.blamed == []
    assert abs(watched.rate[X]) > 5e-3
    length[4] = np.copysign(1e-5, watched.unseen[4])
    judge.watch(length, amplifiers.arrays.current, True)
    assert watched.position[X] == pytest.approx(length[4], abs=1e-9)
    assert watched.rate[X] == 0.0
    assert abs(watched.disturbance[X]) <= PARAMETERS.fault.friction[X]
    assert watched.unseen[4] == 0.0


@pytest.mark.parametrize('along', [X, Z])
def test_what_is_done_without_rests_where_it_was_read_and_the_others_move_on(along: int) -> None:
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 1e-3, 2e-3])
    for _ in range(3):
        judge.watch(length, np.zeros(12), True)
    watched = judge.arrays
    watched.position[:], watched.rate[:], watched.disturbance[:] = 4e-3, 0.1, 0.3
    judge.lose(3 + along)
    for of, value, then in (
        (watched.position, 4e-3, length[3 + along]),
        (watched.rate, 0.1, 0.0),
        (watched.disturbance, 0.3, 0.0),
    ):
        wanted = np.full(5, value)
        wanted[along] = then
        np.testing.assert_array_equal(of, wanted)
    assert judge.blamed == judge.failed == [3 + along]
