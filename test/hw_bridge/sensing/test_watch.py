"""What the guard makes of one sample after another: its codes, whom it blames, what it keeps."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import PARAMETERS, Hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import LOST, PUT_RIGHT, SOUND
from maglev_hw_bridge.sensing.standing_still import call_the_roll
from maglev_model.axes import AXES, X, Y
from maglev_model.parameters import build


def test_what_may_come_of_a_sample_is_told_apart() -> None:
    codes = ('FINE', 'JUMP', 'STUCK', 'RESIDUAL', 'GAP_RANGE', 'RANGE', 'MOTORS')
    assert len({getattr(guard, name) for name in codes}) == len(codes)


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize('side', ['soft_lower', 'soft_upper'])
def test_out_of_its_soft_range_it_is_named_in_flight(axis: int, side: str) -> None:
    hover = Hover()
    bound = getattr(hover.watched, side)
    bound[X] = 0.0  # which is where it is
    assert hover.sample() == (guard.FINE, 0)
    bound[X] = PARAMETERS.fault.lower[X] if side == 'soft_lower' else PARAMETERS.fault.upper[X]
    out = 1e-9 if side == 'soft_lower' else -1e-9
    bound[axis] = hover.watched.position[axis] - out
    assert hover.sample() == (guard.FINE, 0)
    bound[axis] = hover.watched.position[axis] + out
    assert hover.sample(flying=False) == (guard.FINE, 0)
    assert hover.sample() == (guard.RANGE, axis)


@pytest.mark.parametrize(('side', 'gap'), [('gap_lower', 0), ('gap_upper', 2)])
def test_a_gap_out_of_its_range_is_named_in_flight(side: str, gap: int) -> None:
    """Tilted by 1 mrad the first is the least, the third the largest."""
    hover = Hover(phi=1e-3)
    out = 1e-9 if side == 'gap_lower' else -1e-9
    for still in (hover.length[gap] - out, hover.length[gap]):
        setattr(hover.watched, side, still)
        assert hover.sample() == (guard.FINE, 0)
    setattr(hover.watched, side, hover.length[gap] + out)
    assert hover.sample(flying=False) == (guard.FINE, 0)
    assert hover.sample() == (guard.GAP_RANGE, gap)


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_what_the_currents_do_not_explain_for_ten_samples_is_their_motors_fault(
    axis: int, way: float
) -> None:
    hover = Hover()

    def unexplained() -> tuple[int, int]:
        hover.watched.disturbance[axis] = way * 1.01 * PARAMETERS.fault.unexplained[axis]
        hover.watched.position[:] = [0.025, 0.0, 0.0, 0.0, 0.0]
        hover.watched.rate[:] = 0.0
        return hover.sample()

    for _ in range(2):
        assert [unexplained() for _ in range(9)] == [(guard.FINE, 0)] * 9
        hover.watched.disturbance[axis] = 0.0
        assert hover.sample() == (guard.FINE, 0)
    assert [unexplained() for _ in range(10)][8:] == [(guard.FINE, 0), (guard.MOTORS, axis)]


@pytest.mark.parametrize('why', ['on the ground', 'not settled', 'not all sound', 'on its stop'])
def test_unless_something_else_may_explain_it(why: str) -> None:
    hover = Hover(settled=why != 'not settled')
    hover.watched.max_unexplained[:] = -1.0  # anything is too much
    if why == 'not all sound':
        hover.watched.trust[5] = PUT_RIGHT
    if why == 'on its stop':
        hover.watched.upper[Y] = 0.02505
    for _ in range(31):
        assert hover.sample(flying=why != 'on the ground') == (guard.FINE, 0)


def test_nor_before_the_disturbance_is_found() -> None:
    hover = Hover()
    hover.watched.samples = hover.watched.settling - 1
    hover.watched.max_unexplained[:] = -1.0
    codes = [hover.sample()[0] for _ in range(11)]
    assert codes == [guard.FINE] * 10 + [guard.MOTORS]


@pytest.mark.parametrize('encoder', range(4))
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_gaps_that_creep_apart_contradict_each_other_from_the_second_sample(
    encoder: int, way: float
) -> None:
    hover = Hover()
    creep = 1e-5
    while abs(hover.length[encoder] + way * creep - 0.025) <= PARAMETERS.fault.residual:
        hover.length[encoder] += way * creep
        assert hover.sample()[0] == guard.FINE
    hover.length[encoder] += way * creep
    assert hover.sample()[0] == guard.FINE
    assert hover.sample() == (guard.RESIDUAL, 0)
    hover.watched.trust[encoder] = LOST  # of three gaps any can be a rigid platen's
    assert hover.sample()[0] == guard.FINE


@pytest.mark.parametrize('gone', [4, 5])
def test_for_that_x_and_z_need_not_be_believed(gone: int) -> None:
    hover = Hover()
    hover.judge.lose(gone)
    hover.watched.contradictions = 1
    hover.watched.max_residual = -1.0
    assert hover.sample() == (guard.RESIDUAL, 0)


@pytest.mark.parametrize('encoder', range(4))
def test_nor_is_a_gap_believed_up_to_the_last_sample_of_its_probation(encoder: int) -> None:
    hover = Hover()
    hover.watched.max_residual = -1.0
    for left, code in ((3, guard.FINE), (2, guard.FINE), (1, guard.RESIDUAL)):
        hover.watched.probation[encoder] = left
        hover.watched.contradictions = 1
        assert hover.sample()[0] == code


@pytest.mark.parametrize('encoder', range(6))
def test_one_that_slips_is_blamed_put_right_and_believed_on(encoder: int) -> None:
    hover = Hover()
    hover.length[encoder] += 3e-4
    assert hover.sample() == (guard.JUMP, encoder)
    assert hover.judge.blamed == [encoder]
    for _ in range(100):
        assert hover.sample() == (guard.FINE, 0)
        assert hover.judge.blamed == []
        expected = [0.025] * 4 + [0.0, 0.0]
        np.testing.assert_allclose(hover.watched.believed, expected, atol=2e-6)
    assert hover.watched.trust.tolist() == [PUT_RIGHT if i == encoder else SOUND for i in range(6)]


def test_x_that_the_model_moves_and_that_does_not_count_is_stuck() -> None:
    hover = Hover()
    hover.watched.model_rate[X] = 0.5
    found = []
    while not found or found[-1] == (guard.FINE, 0):
        found.append(hover.sample())
        assert len(found) < 10
    assert found[-1] == (guard.STUCK, 4)
    assert hover.judge.failed == [4]


def test_what_is_lost_reads_what_is_foretold() -> None:
    hover = Hover()
    hover.judge.lose(4)
    hover.watched.position[X] = 2e-3
    hover.sample()
    assert hover.watched.believed[4] == hover.watched.length[4] == pytest.approx(2e-3, abs=1e-6)


def test_the_last_two_samples_are_kept() -> None:
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    read = []
    for step in range(4):
        length[4] = 1e-5 * step * step
        read.append(length.copy())
        judge.watch(length, np.zeros(12), True)
        assert judge.arrays.past[0].tolist() == read[-1].tolist()
        assert judge.arrays.past[1].tolist() == read[max(step - 1, 0)].tolist()


@pytest.mark.parametrize('y', [0.025, PARAMETERS.machine.gap_max])
def test_the_first_sample_is_where_it_begins(y: float) -> None:
    """Aloft every gap has answered the roll; on the stop none has."""
    judge = guard.Guard(PARAMETERS)
    judge.arrays.left[:] = judge.arrays.residual_then[:] = 1.0
    judge.arrays.answered[:] = 7
    assert judge.watch(np.array([y + 1e-5, y, y, y, 0.0, 0.0]), np.zeros(12), False) == (0, 0)
    np.testing.assert_allclose(judge.arrays.residual_then, 1e-5, atol=1e-12)
    assert judge.arrays.answered.tolist() == [int(y == 0.025)] * 4
    assert not judge.arrays.left.any()


def test_from_the_third_sample_on_a_leap_is_seen_aloft_and_on_the_stop_from_the_second() -> None:
    for y, second in ((0.025, guard.FINE), (PARAMETERS.machine.gap_max, guard.JUMP)):
        for slips, code in ((1, second), (2, guard.JUMP)):
            judge, length = guard.Guard(PARAMETERS), np.array([y, y, y, y, 0.0, 0.0])
            for number in range(slips + 1):
                judge.arrays.step[:] = 2e-4 if number == 1 else judge.arrays.step
                length[5] += 2e-4 if number == slips else 0.0
                found, index = judge.watch(length, np.zeros(12), False)
            assert (found, index) == (code, 5 if code == guard.JUMP else 0)


def test_on_the_stop_the_second_sample_says_where_it_is() -> None:
    judge, stop = guard.Guard(PARAMETERS), PARAMETERS.machine.gap_max
    length = np.array([stop, stop, stop, stop, 0.0, 0.0])
    judge.watch(length, np.zeros(12), False)
    length[:4] -= 1e-5
    judge.watch(length, np.zeros(12), False)
    assert judge.arrays.position[Y] == pytest.approx(stop - 1e-5, abs=1e-12)


@pytest.mark.parametrize('behind', [0, 1, 3])
@pytest.mark.parametrize('settles', [False, True])
def test_read_at_once_but_late_an_encoder_has_moved_on(behind: int, settles: bool) -> None:
    """x is read at once, z at the tick; both move at 20 mm/s."""
    hover = Hover()
    hover.watched.at_once[:] = [0, 0, 0, 0, 1, 0]
    step = 2e-5
    hover.watched.rate[1:3] = step / PARAMETERS.sample_time
    for number in range(1, 30):
        late = behind if number > 3 else 0
        hover.length[4] = step * (number + late)
        hover.length[5] = step * number
        if settles:
            hover.judge.settle()
        assert hover.sample(behind=late) == (guard.FINE, 0), number
        np.testing.assert_allclose(hover.watched.believed[4:], step * number, atol=1e-6)


def test_who_is_read_at_once_is_on_the_second_board() -> None:
    parameters = build(BridgeParameters, {'encoder.board': (0, 1, 0, 1, 1, 0)})
    assert guard.Guard(parameters).arrays.at_once.tolist() == [0.0, 1.0, 0.0, 1.0, 1.0, 0.0]


def test_before_it_knows_how_fast_they_move_what_is_late_is_taken_as_read() -> None:
    judge, length = guard.Guard(PARAMETERS), np.array([0.025, 0.025, 0.025, 0.025, 0.0, 0.0])
    judge.arrays.at_once[:], judge.arrays.step[:] = 1.0, 1e-3
    for _ in range(2):
        judge.watch(length, np.zeros(12), False, 2)
        np.testing.assert_array_equal(judge.arrays.believed, length)
    judge.forget()
    assert not judge.arrays.step.any()


def test_homed_anew_every_encoder_is_believed_and_its_past_forgotten() -> None:
    hover = Hover()
    watched = hover.watched
    for _ in range(2):
        hover.length[0] += 3e-4
        hover.sample()
    hover.judge.lose(5)
    watched.unseen[:], watched.silent[:], watched.contradictions = 1.0, 3, 1
    hover.judge.settle()
    assert watched.samples == 2
    hover.judge.settle()
    assert watched.samples == 2
    hover.judge.forget()
    assert (watched.samples, watched.contradictions) == (0, 0)
    assert not watched.unseen.any()
    assert not watched.rate.any()
    assert not watched.silent.any()
    assert hover.judge.failed == [0, 5]
    hover.judge.trust()
    assert hover.judge.failed == []
    for gone in (watched.stood, watched.probation, watched.offset):
        assert not gone.any()


@pytest.mark.parametrize(
    ('lost', 'blind'),
    [
        ((), ()),
        ((0,), ()),
        ((0, 2), ('phi',)),
        ((1, 3), ('theta',)),
        ((0, 1), ('phi',)),
        ((0, 1, 2), ('phi', 'theta')),
        ((0, 1, 3), ('phi', 'theta')),
        ((0, 1, 2, 3), ('y', 'phi', 'theta')),
        ((4,), ('x',)),
        ((5,), ('z',)),
        ((0, 4), ('x',)),
        ((1, 4), ('x',)),
        ((2, 3, 4, 5), ('x', 'z', 'phi')),
    ],
)
def test_which_axes_nothing_shows(lost: tuple[int, ...], blind: tuple[str, ...]) -> None:
    judge = guard.Guard(PARAMETERS)
    judge.arrays.trust[list(lost)] = LOST
    assert tuple(axis for axis, hidden in zip(AXES, judge.blind, strict=True) if hidden) == blind


def test_x_and_z_that_slipped_are_believed_but_not_relied_on() -> None:
    judge = guard.Guard(PARAMETERS)
    judge.arrays.trust[:] = PUT_RIGHT
    assert judge.blind.tolist() == [False, True, True, False, False]


@pytest.mark.parametrize(('period', 'samples'), [(1e-3, 10), (2e-3, 5)])
def test_what_is_given_as_a_time_takes_as_long_at_any_sample_time(
    period: float, samples: int
) -> None:
    """10 ms of a disturbance, 20 ms on probation, 100 ms to settle."""
    slow = {'sample_time': period, 'fault.stale': 0.02, 'boards.watchdog': 0.02}
    hover = Hover(settled=False, parameters=build(BridgeParameters, slow))
    watched = hover.watched
    assert watched.settling == round(0.1 / period)
    watched.samples = watched.settling - 1
    for number in range(samples + 1):
        watched.disturbance[Y] = 1.01 * PARAMETERS.fault.unexplained[Y]
        watched.disturbance_then[Y] = watched.unseen[:4] = 0.0  # which no encoder has told of
        watched.position[:] = [0.025, 0.0, 0.0, 0.0, 0.0]
        watched.rate[:] = 0.0
        assert hover.sample()[0] == (guard.MOTORS if number == samples else guard.FINE)
    hover.length[4] += 3e-4
    assert hover.sample() == (guard.JUMP, 4)
    assert watched.probation[4] == round(0.02 / period) - 1


def test_what_one_sample_shows_may_be_noise_however_long_it_is() -> None:
    slow = {'sample_time': 1e-2, 'fault.stale': 0.02, 'boards.watchdog': 0.02}
    assert guard.Guard(build(BridgeParameters, slow)).arrays.unexplainable == 2


@pytest.mark.parametrize('period', [1e-3, 5e-3])
def test_how_fast_a_platen_leaves_its_stop_is_a_speed(period: float) -> None:
    slow = {'sample_time': period, 'fault.stale': 0.02, 'boards.watchdog': 0.02}
    hover = Hover(parameters=build(BridgeParameters, slow))
    for speed, left in ((0.034, 1.0), (0.036, 0.0)):
        watched = hover.watched
        watched.left[:] = 0.0
        watched.believed[:4] = watched.past[0, :4] - speed * period
        call_the_roll(watched.block[0], True, np.zeros(6, np.bool_))
        assert watched.left == pytest.approx(-left * speed * period * np.ones(4))
