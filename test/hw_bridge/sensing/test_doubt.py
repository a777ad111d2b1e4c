"""What speaks against encoders that stand still, and against which."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import PARAMETERS, hovering

from maglev_hw_bridge.sensing.guard_arrays import LOST, GuardArrays
from maglev_hw_bridge.sensing.standing_still import (
    CONTRADICTED,
    UNSEEN,
    doubt,
)

STOP = PARAMETERS.machine.gap_max


def doubts(watched: GuardArrays, *, flying: bool = True) -> tuple[int, list[int]]:
    """What speaks against encoders, and against which."""
    doubted = np.ones(6, bool)
    against = doubt(watched.block[0], flying, doubted)
    return against, np.flatnonzero(doubted).tolist()


@pytest.mark.parametrize('flying', [True, False])
@pytest.mark.parametrize('gone', ['', 'lost', 'in probation'])
def test_four_believed_gaps_in_flight_are_those_of_a_rigid_platen(flying: bool, gone: str) -> None:
    for encoder in range(6):
        watched = hovering()
        if gone == 'lost':
            watched.trust[encoder] = LOST
        if gone == 'in probation':
            watched.probation[encoder] = 1
        assert doubts(watched, flying=flying) == (0, [])
        assert watched.rigid is (flying and (not gone or encoder >= 4))


@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_a_gap_is_doubted_when_it_should_have_moved_and_three_tell_without_it(way: float) -> None:
    for encoder in range(4):
        watched = hovering()
        watched.length[:4] += 1e-3  # the others do not agree with the model at all
        watched.unseen[encoder] = way * 2.4e-5
        assert doubts(watched) == (0, [])
        watched.unseen[encoder] = way * 2.6e-5
        assert doubts(watched) == (UNSEEN, [encoder])


@pytest.mark.parametrize('off', [1.9e-5, -1.9e-5, 2.1e-5, -2.1e-5])
def test_two_gaps_are_doubted_where_the_model_agrees_with_the_others(off: float) -> None:
    watched = hovering()
    watched.unseen[[0, 1]] = 3e-5
    watched.length[2] += off
    watched.length[0] += 1.0  # of one that is doubted nothing is asked
    assert doubts(watched) == ((UNSEEN, [0, 1]) if abs(off) < 2e-5 else (0, []))


@pytest.mark.parametrize('share', [1.49, -1.49, 1.51, -1.51])
def test_or_where_one_should_have_moved_far_whatever_the_others_read(share: float) -> None:
    watched = hovering()
    watched.length[2:4] += 1.0
    others = 1.45 * np.sign(share), share  # times, which tilt nothing that the others could deny
    watched.unseen[:2] = np.multiply(others, PARAMETERS.fault.stuck_gap)
    assert doubts(watched) == ((UNSEEN, [0, 1]) if abs(share) > 1.5 else (0, []))


@pytest.mark.parametrize(
    ('unseen', 'missing'),
    [
        ((9.9e-5, 0.0, 0.0, 0.0), 0.0),
        ((1.01e-4, 0.0, 0.0, 0.0), 1.01e-4),
        ((0.0, -2e-4, 0.0, 0.0), 2e-4),
        ((0.0, 0.0, 3e-4, -2.4e-5), 3e-4),
        ((1e-4, 1e-4, 0.0, 0.0), 0.0),
        ((1e-4, 0.0, -1e-4, 0.0), 0.0),
        ((1e-4, 0.0, 3e-5, 0.0), 1.3e-4),
        ((0.0, -1e-4, 0.0, -3e-5), 1.3e-4),
        ((1e-4, -3e-5, 0.0, 0.0), 1.3e-4),
        ((4e-4, 4e-4, 4e-4, 4e-4), 0.0),
    ],
)
@pytest.mark.parametrize('shown', [0.0, -0.49, 0.49, 0.51, -0.51])
def test_but_not_where_the_others_deny_that_a_rigid_platen_moved_so(
    unseen: tuple[float, ...], missing: float, shown: float
) -> None:
    """What stuck encoders do not show of it, four gaps would contradict each other by."""
    watched = hovering()
    watched.unseen[:4] = unseen
    watched.residual_then[:] = shown * missing
    doubted = np.flatnonzero(np.abs(unseen) > 2.5e-5).tolist()
    if missing and abs(shown) < 0.5:
        assert doubts(watched)[0] != UNSEEN
    else:
        assert doubts(watched) == (UNSEEN, doubted)
    watched.residual_then[:] = 0.0
    watched.probation[3] = 1  # no rigid platen any more: nobody can deny
    assert doubts(watched) == (UNSEEN, [i for i in doubted if i != 3])


def test_one_that_is_lost_or_in_probation_is_not_doubted_nor_asked() -> None:
    for gone in range(6):
        for why in ('trust', 'probation'):
            watched = hovering()
            watched.unseen[:] = 3e-5
            getattr(watched, why)[gone] = LOST if why == 'trust' else 1
            watched.length[gone] += 1.0
            assert doubts(watched) == (UNSEEN, [i for i in range(6) if i != gone])


def test_a_bound_that_is_just_reached_is_not_yet_passed() -> None:
    """To the last bit: in each case one more would say otherwise."""
    watched = hovering()
    watched.unseen[:4] = 2.5e-5
    assert doubts(watched) == (0, [])
    watched = hovering()
    watched.unseen[:2], watched.length[2] = 1.5 * PARAMETERS.fault.stuck_gap, 1.0
    assert doubts(watched) == (0, [])
    watched.unseen[1] = np.nextafter(watched.unseen[1], 1.0)
    assert doubts(watched) == (UNSEEN, [0, 1])
    watched = hovering()
    watched.unseen[:2], watched.believed[2], watched.length[2] = 3e-5, 2e-5, 0.0
    assert doubts(watched) == (UNSEEN, [0, 1])
    watched = hovering()
    watched.residual_then[0] = 6e-5
    assert doubts(watched) == (0, [])
    watched.residual_then[1] = 7e-5
    assert doubts(watched) == (CONTRADICTED, [1])
    watched = hovering()
    watched.unseen[0] = 1e-4
    assert doubts(watched) == (UNSEEN, [0])
    watched.unseen[0], watched.residual_then[0] = 2.0**-13, 2.0**-14
    assert doubts(watched) == (UNSEEN, [0])


def test_what_x_and_z_should_have_moved_no_gap_denies() -> None:
    watched = hovering()
    watched.unseen[[0, 4]] = 5e-5, 3e-4
    assert doubts(watched) == (UNSEEN, [0, 4])


def test_x_and_z_are_doubted_only_with_gaps_but_keep_their_doubt() -> None:
    watched = hovering()
    watched.unseen[4] = 1e-3
    assert doubts(watched) == (0, [4])


@pytest.mark.parametrize('which', [(0,), (2,), (1, 3), (0, 1), (0, 1, 2), (0, 1, 2, 3)])
@pytest.mark.parametrize('size', [5.9e-5, -5.9e-5, 6.1e-5, -6.1e-5])
def test_gaps_that_contradict_each_other_since_one_or_two_counted(
    which: tuple[int, ...], size: float
) -> None:
    """One or two of them may be stuck; of three or four nobody knows which."""
    watched = hovering()
    watched.residual_then[list(which)] = size
    known = abs(size) > 6e-5 and len(which) <= 2
    assert doubts(watched) == ((CONTRADICTED, list(which)) if known else (0, []))
    watched.probation[3] = 1  # no rigid platen any more: no contradiction
    assert doubts(watched) == (0, [])


def test_what_has_contradicted_itself_since_before_its_count_says_nothing_new() -> None:
    """A machine whose guides are bent does so all the time."""
    watched = hovering()
    watched.believed[0] = watched.length[0] = 0.025 + 1e-4
    watched.residual_then[:] = 1e-4
    assert doubts(watched) == (0, [])


def test_of_two_gaps_nothing_can_be_contradicted() -> None:
    watched = hovering()
    watched.trust[:2] = LOST
    watched.residual_then[:] = 1.0
    assert doubts(watched) == (0, [])
