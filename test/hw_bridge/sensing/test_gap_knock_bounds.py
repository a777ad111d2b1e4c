"""How gaps are asked, sample by sample: which, when, how hard, and what is an answer."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import Hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.gap_knock import GapKnock
from maglev_hw_bridge.sensing.guard_arrays import LOST, GuardArrays
from maglev_model.axes import FloatArray, Y
from maglev_model.machine import machine_constants
from maglev_model.parameters import build
from maglev_model.platen import output_accelerations

TWO = [(0, 1), (1, 2), (2, 3), (0, 3), (0, 2), (1, 3)]
THREE = [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
ALL = (0, 1, 2, 3)
PATIENCE = 30  # [samples]
HARDEST = 4.6  # 2 (0.8 + 2.4 * 10 um / (4 ms)^2) [m/s²]
SHARES = (1 / 16, 1 / 11, 1 / 8, 1 / 4, 1 / 2, 1.0)
SOFTEST = HARDEST / 16
WHOLE = 8 * len(SHARES) + 4  # unanswered [samples]


def asked(silent: dict[int, int], **overrides: object) -> tuple[GapKnock, GuardArrays]:
    """All gaps, and what they are watched by; those are ``silent`` for so many samples."""
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    watched: GuardArrays = Hover().watched
    watched.silent[:] = 0
    for gap, samples in silent.items():
        watched.silent[gap] = samples
    return GapKnock(build(BridgeParameters, named)), watched


def begins(asking: GapKnock, watched: GuardArrays, *, flying: bool = True) -> bool:
    assert asking.look(watched, flying) == ()
    return asking._pushes.under_way


def answer(asking: GapKnock, watched: GuardArrays) -> None:
    """All count soon."""
    for _ in range(2):
        watched.silent[:4] += 1
        assert asking.look(watched, True) == ()
    watched.silent[:] = 0
    assert asking.look(watched, True) == ()
    assert not asking._pushes.under_way


@pytest.mark.parametrize('late', [-1, 0, 1])
@pytest.mark.parametrize('pair', TWO)
def test_two_are_asked_when_they_have_been_silent_for_long_twice_as_long_face_to_face(
    pair: tuple[int, int], late: int
) -> None:
    patience = PATIENCE * (2 if pair in ((0, 2), (1, 3)) else 1)
    asking, watched = asked({pair[0]: patience + late, pair[1]: patience})
    assert begins(asking, watched) == (late >= 0)


@pytest.mark.parametrize('three', THREE)
def test_three_are_asked_as_soon_as_neighbours(three: tuple[int, ...]) -> None:
    assert begins(*asked(dict.fromkeys(three, PATIENCE)))


@pytest.mark.parametrize('gap', ALL)
def test_one_is_not_for_the_others_tell(gap: int) -> None:
    assert not begins(*asked({gap: 10**6}))


def test_x_and_z_are_no_gaps() -> None:
    assert not begins(*asked({3: 1000, 4: 1000, 5: 1000}))


def test_who_is_lost_is_not_asked() -> None:
    asking, watched = asked({0: 1000, 1: 1000})
    watched.trust[0] = LOST
    assert not begins(asking, watched)


def test_with_no_silence_that_is_too_long_it_is_never_asked() -> None:
    assert not begins(*asked(dict.fromkeys(ALL, 10**6), fault__gap_silence=0.0))


def test_each_answer_doubles_the_patience_with_such_and_no_others_up_to_a_bound() -> None:
    asking, watched = asked({})
    for times in range(10):
        expected = PATIENCE * min(2**times, 128)
        assert (asking.patience(False), asking.patience(True)) == (expected, 2 * PATIENCE)
        watched.silent[:2] = expected
        assert begins(asking, watched)
        answer(asking, watched)
    watched.silent[[1, 3]] = 2 * PATIENCE
    assert begins(asking, watched)
    answer(asking, watched)
    assert (asking.patience(False), asking.patience(True)) == (128 * PATIENCE, 4 * PATIENCE)


def test_with_the_flight_it_ends_and_is_forgotten() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    assert begins(asking, watched)
    answer(asking, watched)
    watched.silent[:2] = 2 * PATIENCE
    assert begins(asking, watched)
    assert not begins(asking, watched, flying=False)
    assert (asking.patience(False), asking.patience(True)) == (PATIENCE, 2 * PATIENCE)
    watched.silent[:] = 0
    assert not begins(asking, watched)


def test_to_and_fro_and_a_wait_then_it_is_told_who_did_not_count_since() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE, 2: 0, 3: 5})
    assert begins(asking, watched)
    pushes, found = [], []
    for sample in range(WHOLE):
        pushes.append(asking._pushes.acceleration)
        watched.silent[:4] += 1
        if sample == 10:
            watched.silent[3] = 0
        found.append(asking.look(watched, True))
    hard = [HARDEST * share for share in SHARES]
    to_and_fro = [push for a in hard for push in (a, a, a, a, -a, -a, -a, -a)]
    assert pushes == pytest.approx(to_and_fro + [0.0] * 4)
    assert found == [()] * (WHOLE - 1) + [(0, 1, 2)]
    assert not asking._pushes.under_way


@pytest.mark.parametrize(('period', 'length'), [(1e-3, 4), (2e-3, 2), (4e-3, 2)])
def test_the_hardest_moves_it_over_the_coarsest_count_against_twice_the_friction(
    period: float, length: int
) -> None:
    parameters = build(
        BridgeParameters,
        {
            'sample_time': period,
            'fault.friction': [0.7, 0.3, 0.5, 3.0, 3.0],
            'encoder.resolution': [1e-5, 2e-6, 2e-5, 5e-6, 5e-5, 5e-5],
            'fault.stale': 0.02,
            'boards.watchdog': 0.05,
        },
    )
    pushes = GapKnock(parameters)._pushes
    free = 2.4 * 2e-5 / (length * period) ** 2
    assert pushes._pushes[-1] == pytest.approx(2.0 * (0.7 + free))
    assert pushes._duration == length


@pytest.mark.parametrize('silent', [*TWO, *THREE, ALL])
def test_it_goes_on_until_all_but_one_have_counted(silent: tuple[int, ...]) -> None:
    asking, watched = asked(dict.fromkeys(silent, 2 * PATIENCE))
    assert begins(asking, watched)
    *answering, _ = silent
    for sample in range(1, 3 * len(answering) + 1):
        watched.silent[list(silent)] += 1
        if sample % 3 == 0:
            watched.silent[answering[sample // 3 - 1]] = 0
        assert asking.look(watched, True) == ()
        assert asking._pushes.under_way == (sample < 3 * len(answering)), sample


@pytest.mark.parametrize(
    ('passed', 'way'),
    [((1, 1, 1), -1.0), ((-1, -1, -1), 1.0), ((1, -1, 1), -1.0), ((1, -1, -1), 1.0), ((0,) * 3, 1)],
)
def test_most_of_those_asked_are_pushed_back_over_their_last_edge(
    passed: tuple[int, ...], way: float
) -> None:
    asking, watched = asked({})
    assert not begins(asking, watched)
    watched.believed[:4] += 1e-5 * np.array([passed[0], passed[1], -5, passed[2]])
    assert not begins(asking, watched)
    watched.silent[[0, 1, 3]] = PATIENCE  # gap 3 counts, and is not asked
    assert begins(asking, watched)
    assert asking._pushes.acceleration == pytest.approx(way * SOFTEST)


def test_what_is_added_accelerates_y_by_as_much_and_takes_no_quadrature_current() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    watched.position[:] = [0.022, 0.01, -0.02, 1e-3, -2e-3]
    i_d, i_q = np.array([0.3, -0.2, 0.5, 0.1]), np.array([0.1, 0.2, -0.3, 0.4])
    assert asking.added(watched, i_d, i_q) is i_d
    assert begins(asking, watched)
    given = i_d.copy()
    added = asking.added(watched, i_d, i_q)
    assert np.array_equal(i_d, given)
    assert np.ptp(added - i_d) < 1e-12
    machine = machine_constants(BridgeParameters().machine)
    y, phi, theta = watched.position[[0, 3, 4]]

    def along_y(direct: FloatArray) -> float:
        return float(output_accelerations(machine, y, phi, theta, direct, i_q)[Y])

    step = 1e-4 * (added - i_d)  # the attraction is a square: by its slope where it is
    slope = (along_y(i_d + step) - along_y(i_d - step)) / 2e-4
    assert slope == pytest.approx(SOFTEST, rel=1e-6)


def test_as_much_as_the_motors_have_is_not_too_much() -> None:
    asking, watched = asked({0: PATIENCE, 1: PATIENCE})
    assert begins(asking, watched)
    i_d, i_q = np.array([-3.0, -0.1, -0.1, -0.1]), np.array([4.0, 0.0, 0.0, 0.0])
    most = float(np.max(np.hypot(asking.added(watched, i_d, i_q), i_q)))
    asking._limit = most
    assert asking.added(watched, i_d, i_q) is not i_d
    asking._limit = np.nextafter(most, 0.0)
    assert asking.added(watched, i_d, i_q) is i_d
    assert not asking._pushes.under_way
