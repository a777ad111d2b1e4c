"""How x and z are asked, sample by sample: how hard, how long, which way, and what is an answer."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import Hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import knock
from maglev_hw_bridge.sensing.guard_arrays import GuardArrays
from maglev_hw_bridge.sensing.knock import Knock
from maglev_model.axes import X, Z
from maglev_model.machine import machine_constants
from maglev_model.parameters import build
from maglev_model.platen import output_accelerations

HARDEST, LENGTH = 3.7, 4  # [m/s²], [samples]
KNOCKS, GROWTH = 16, 1.25
WHOLE = (2 * KNOCKS + 1) * LENGTH  # unanswered [samples]
SOFTEST = HARDEST / GROWTH ** (KNOCKS - 1)
COUNT = 1e-5
PATIENCE = 150  # [samples]


def asked(**silent: int) -> tuple[Knock, GuardArrays]:
    """Both axes and what they are watched by; ``silent`` for so many samples."""
    watched: GuardArrays = Hover().watched
    watched.silent[4:] = [silent.get('x', 0), silent.get('z', 0)]
    return Knock(build(BridgeParameters, {})), watched


def one() -> knock._Asked:
    asking = knock._Asked(X, HARDEST, LENGTH)
    asking.begin(1.0)
    return asking


def test_without_an_answer_all_knocks_each_to_and_fro_and_a_wait() -> None:
    asking = one()
    pushes, lost = [], False
    for _ in range(WHOLE):
        assert asking.under_way
        assert not lost
        pushes.append(asking.acceleration)
        lost = asking.go_on(False)
    hard = [SOFTEST * GROWTH**n for n in range(KNOCKS)]
    to_and_fro = [push for a in hard for push in (a, a, a, a, -a, -a, -a, -a)]
    assert pushes == pytest.approx(to_and_fro + [0.0] * 4)
    assert lost
    assert not asking.under_way


@pytest.mark.parametrize('knocks', [0, 3, KNOCKS - 1])
@pytest.mark.parametrize('answer', [1, 2, 4, 5, 8])
def test_an_answer_ends_it_and_leaves_the_braking_to_the_controller(
    knocks: int, answer: int
) -> None:
    asking = one()
    for _ in range(8 * knocks):
        assert not asking.go_on(False)
    pushes = []
    for sample in range(1, answer + 1):
        assert asking.under_way
        pushes.append(asking.acceleration)
        assert not asking.go_on(sample == answer)
    push = SOFTEST * GROWTH**knocks
    assert pushes == pytest.approx([push] * min(answer, 4) + [-push] * (answer - 4))
    assert not asking.under_way


@pytest.mark.parametrize('answer', [1, 4])
def test_an_answer_may_come_late(answer: int) -> None:
    asking = one()
    for _ in range(2 * KNOCKS * LENGTH):
        assert not asking.go_on(False)
    for sample in range(1, answer + 1):
        assert asking.under_way
        assert asking.acceleration == 0.0
        assert not asking.go_on(sample == answer)
    assert not asking.under_way


def test_a_new_asking_begins_as_softly_and_unanswered() -> None:
    asking = one()
    for _ in range(20):
        asking.go_on(False)
    asking.go_on(True)
    asking.begin(-1.0)
    assert asking.under_way
    assert asking.acceleration == pytest.approx(-SOFTEST)
    for _ in range(WHOLE - 1):
        assert not asking.go_on(False)
    assert asking.go_on(False)


def test_which_way_each_passed_its_last_edge() -> None:
    edges = knock.Edges(2)
    assert edges.passed == [0.0, 0.0]
    for reading, way in ((0.0, 0.0), (1e-5, 1.0), (1e-5, 1.0), (0.0, -1.0), (-1e-5, -1.0)):
        edges.follow(np.array([reading, -2.0 * reading]))
        assert edges.passed == [way, -way]


@pytest.mark.parametrize(('period', 'length'), [(1e-3, 4), (2e-3, 2), (4e-3, 2)])
def test_the_hardest_moves_it_over_a_count_against_twice_the_friction(
    period: float, length: int
) -> None:
    friction, resolution = [0.8, 0.3, 0.5, 3.0, 3.0], [1e-5] * 4 + [4e-6, 2e-5]
    parameters = build(
        BridgeParameters,
        {
            'sample_time': period,
            'fault.friction': friction,
            'encoder.resolution': resolution,
            'fault.stale': 0.02,
            'boards.watchdog': 0.05,
            'fault.silence': 0.1,
        },
    )
    asking = Knock(parameters)
    assert asking._patience == round(0.1 / period)
    assert [of.axis for of in asking._asked] == [X, Z]
    for of in asking._asked:
        free = 2.4 * resolution[3 + of.axis] / (length * period) ** 2
        assert of._pushes[-1] == pytest.approx(2.0 * (friction[of.axis] + free))
        assert of._duration == length


@pytest.mark.parametrize(('silent', 'begins'), [(149, False), (150, True), (151, True)])
@pytest.mark.parametrize('axis', [0, 1])
def test_it_is_asked_after_a_while(axis: int, silent: int, *, begins: bool) -> None:
    asking, watched = asked()
    watched.silent[4 + axis] = silent
    assert asking.look(watched, True) is None
    assert [of.under_way for of in asking._asked] == [begins and k == axis for k in range(2)]


def test_with_no_silence_that_is_too_long_it_is_never_asked() -> None:
    asking = Knock(build(BridgeParameters, {'fault.silence': 0.0}))
    watched = Hover().watched
    watched.silent[:] = 10**6
    asking.look(watched, True)
    assert not any(of.under_way for of in asking._asked)


def test_who_does_not_answer_is_told_and_the_other_is_not() -> None:
    asking, watched = asked(x=PATIENCE, z=PATIENCE)
    asking.look(watched, True)
    found = []
    for sample in range(WHOLE):
        watched.silent[4:] = [151 + sample, 0 if sample == 10 else 151 + sample]
        found.append(asking.look(watched, True))
    assert found == [None] * (WHOLE - 1) + [4]
    assert asking.look(watched, True) is None


@pytest.mark.parametrize('axis', [0, 1])
def test_it_is_told_by_its_own_number(axis: int) -> None:
    asking, watched = asked()
    watched.silent[4 + axis] = PATIENCE
    found = [asking.look(watched, True) for _ in range(WHOLE + 1)]
    assert found == [None] * WHOLE + [4 + axis]


def test_with_the_flight_it_ends() -> None:
    asking, watched = asked(x=PATIENCE)
    asking.look(watched, True)
    assert asking._asked[0].under_way
    watched.silent[:] = 0
    assert asking.look(watched, False) is None
    assert not asking._asked[0].under_way


@pytest.mark.parametrize(('pushed', 'way'), [(-0.1, -1.0), (0.0, 1.0), (0.1, 1.0)])
@pytest.mark.parametrize('axis', [0, 1])
def test_where_no_edge_was_seen_it_is_pushed_where_it_leans(
    axis: int, pushed: float, way: float
) -> None:
    asking, watched = asked()
    watched.believed[4:] = 0.0
    watched.disturbance[1 + axis] = 0.3
    watched.acceleration[1 + axis] = 0.3 + pushed
    watched.silent[4 + axis] = PATIENCE
    asking.look(watched, True)
    assert asking._asked[axis].acceleration == pytest.approx(way * SOFTEST)


def along(i_d: np.ndarray, i_q: np.ndarray, watched: GuardArrays) -> np.ndarray:
    machine = machine_constants(BridgeParameters().machine)
    y, phi, theta = watched.position[[0, 3, 4]]
    return np.array(output_accelerations(machine, y, phi, theta, i_d, i_q))


@pytest.mark.parametrize(('axis', 'other'), [(0, 1), (1, 0)])
def test_who_has_answered_is_not_pushed_on(axis: int, other: int) -> None:
    asking, watched = asked()
    watched.silent[4 + other] = PATIENCE
    asking.look(watched, True)
    watched.silent[4 + other] = 0
    for _ in range(2):
        asking.look(watched, True)
    watched.silent[4 + axis] = PATIENCE
    asking.look(watched, True)
    i_d, i_q = np.full(4, 0.3), np.zeros(4)
    more = along(i_d, asking.added(watched, i_d, i_q), watched)
    assert more[X + axis] == pytest.approx(asking._asked[axis].acceleration)
    assert more[X + other] == 0.0


def test_who_was_asked_when_the_flight_ended_is_not_pushed_in_the_next() -> None:
    asking, watched = asked(z=PATIENCE)
    asking.look(watched, True)
    watched.silent[:] = 0
    asking.look(watched, False)
    watched.silent[4] = PATIENCE
    asking.look(watched, True)
    i_d, i_q = np.full(4, 0.3), np.zeros(4)
    more = along(i_d, asking.added(watched, i_d, i_q), watched)
    assert more[X] == pytest.approx(asking._asked[0].acceleration)
    assert more[Z] == 0.0


def test_it_may_be_asked_in_every_sample_without_a_count() -> None:
    asking = Knock(build(BridgeParameters, {'fault.silence': 1e-3}))
    watched = Hover().watched
    watched.silent[:] = 1
    asking.look(watched, True)
    assert [of.under_way for of in asking._asked] == [True, True]


@pytest.mark.parametrize('both', [True, False])
def test_what_is_added_accelerates_it_by_as_much(*, both: bool) -> None:
    asking, watched = asked(x=PATIENCE, z=PATIENCE if both else 0)
    watched.position[:] = [0.022, 0.01, -0.02, 1e-3, -2e-3]
    asking.look(watched, True)
    i_d, i_q = np.array([0.3, -0.2, 0.5, 0.1]), np.array([0.1, 0.2, -0.3, 0.4])
    given = i_q.copy()
    added = asking.added(watched, i_d, i_q)
    assert np.array_equal(i_q, given)
    more = along(i_d, added, watched) - along(i_d, i_q, watched)
    wanted = [of.acceleration if of.under_way else 0.0 for of in asking._asked]
    assert more[[X, Z]] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    assert bool(wanted[1]) == both


def test_as_much_as_the_motors_have_is_not_too_much() -> None:
    asking, watched = asked(x=PATIENCE)
    asking.look(watched, True)
    i_d, i_q = np.array([3.0, 0.1, 0.1, 0.1]), np.array([4.0, 0.0, 0.0, 0.0])
    most = float(np.max(np.hypot(i_d, asking.added(watched, i_d, i_q))))
    asking._limit = most
    assert not np.array_equal(asking.added(watched, i_d, i_q), i_q)
    asking._limit = np.nextafter(most, 0.0)
    assert asking.added(watched, i_d, i_q) is i_q
    assert not asking._asked[0].under_way


def knocks(friction: float) -> tuple[list[float], bool, float]:
    """How hard a platen in the middle of a count is pushed, one after another, whether in vain,
    and how far it came [m].

    ``friction`` is that of its guide, set-valued [m/s²].
    """
    asked = knock._Asked(X, HARDEST, LENGTH)
    asked.begin(1.0)
    place = rate = farthest = 0.0
    hard, lost = [], False
    while asked.under_way and not lost:
        push = asked.acceleration
        hard.append(push)
        free = rate + 1e-3 * push
        after = np.sign(free) * max(abs(free) - 1e-3 * friction, 0.0)
        before, place = place, place + 0.5e-3 * (rate + after)
        rate, farthest = float(after), max(farthest, place)
        lost = asked.go_on(round(place / COUNT) != round(before / COUNT))
    return sorted({push for push in hard if push > 0.0}), lost, farthest


def test_each_knock_is_harder_than_the_one_before_and_ends_with_the_count() -> None:
    for friction in (0.0, 0.05, 0.15, 0.35, 0.7, 1.3):
        hard, lost, farthest = knocks(friction)
        assert not lost
        assert np.allclose(np.divide(hard[1:], hard[:-1]), GROWTH)
        assert hard[-1] < max(6.0 * friction, 0.6)
        assert 0.5 * COUNT < farthest < 1.6 * COUNT


def test_by_what_should_have_moved_it_two_counts_it_is_lost() -> None:
    hard, lost, farthest = knocks(4.0)
    assert lost
    assert farthest == 0.0
    assert hard == pytest.approx([HARDEST / GROWTH**n for n in range(KNOCKS)[::-1]])


def test_pushed_to_and_fro_it_is_where_it_was_and_stands() -> None:
    asked = knock._Asked(X, HARDEST, LENGTH)
    asked.begin(-1.0)
    pushed = []
    while asked.under_way:
        pushed.append(asked.acceleration)
        if asked.go_on(False):
            break
    assert sum(pushed) == pytest.approx(0.0)
    assert len(pushed) == WHOLE


def test_the_push_goes_back_over_the_edge_it_passed_last() -> None:
    asking = knock.Knock(build(BridgeParameters, {}))
    watched = Hover().watched
    asking.look(watched, True)
    for way in (1.0, -1.0):
        watched.believed[4:] += way * COUNT
        watched.silent[:] = 0
        assert asking.look(watched, True) is None
        watched.silent[:] = PATIENCE
        assert asking.look(watched, True) is None
        assert [np.sign(asked.acceleration) for asked in asking._asked] == [-way, -way]
        for asked in asking._asked:
            asked.under_way = False


@pytest.mark.parametrize('limit', ['command_limit', 'over_current'])
def test_nothing_is_asked_on_the_ground_or_with_no_current_left(limit: str) -> None:
    parameters = build(BridgeParameters, {f'fault.{limit}': 6.0})
    asking, watched = knock.Knock(parameters), Hover().watched
    watched.silent[:] = PATIENCE
    assert asking.look(watched, False) is None
    i_d, i_q = np.zeros(4), np.zeros(4)
    watched.silent[:] = 0
    assert asking.look(watched, False) is None
    assert asking.added(watched, i_d, i_q) is i_q

    watched.silent[:] = PATIENCE
    asking.look(watched, True)
    pushed = asking.added(watched, i_d, i_q).copy()
    assert np.all(np.abs(pushed) > 0.01)
    full = np.full(4, 6.0)
    assert asking.added(watched, full, i_q) is i_q
    assert asking.added(watched, i_d, i_q) is i_q, 'it went on after it could not push'


def test_a_single_motor_has_nothing_to_ask_z_with() -> None:
    single = knock.Knock(build(BridgeParameters, {'machine.motors': 1}))
    assert [asked.axis for asked in single._asked] == [1]
