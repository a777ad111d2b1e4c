"""Encoders that leap: once, again, and both along x and z."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import PARAMETERS, Hover

from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import LOST, NOISY, PUT_RIGHT, SOUND
from maglev_hw_bridge.sensing.leaps import find_leaps

JUMP = PARAMETERS.fault.jump
T = PARAMETERS.sample_time


@pytest.mark.parametrize('encoder', [0, 3, 4, 5])
@pytest.mark.parametrize(
    ('off', 'before', 'leaps'),
    [
        (0.99, 0.0, False),
        (-0.99, 0.0, False),
        (1.01, 0.0, True),
        (-1.01, 0.0, True),
        (5.0, 4.02, False),  # as it moved before, whatever the model says
        (5.0, 5.98, False),
        (5.0, 3.98, True),
        (-5.0, -3.98, True),
        (5.0, -5.0, True),
    ],
)
def test_what_moves_neither_as_foretold_nor_as_before_leaps(
    encoder: int, off: float, before: float, leaps: bool
) -> None:
    """By more than the largest jump, of which all these are multiples."""
    watched = Hover().watched
    foretold = 7e-6
    watched.step[:] = foretold
    watched.believed[:] = watched.past[0] + foretold
    watched.past[1] = watched.past[0]
    watched.believed[encoder] += off * JUMP
    watched.past[1, encoder] -= foretold + before * JUMP
    assert find_leaps(watched.block[0]) is leaps
    assert watched.blamed.tolist() == [int(leaps and i == encoder) for i in range(6)]
    assert watched.trust.tolist() == [PUT_RIGHT * (leaps and i == encoder) for i in range(6)]
    if leaps:
        assert watched.offset[encoder] == pytest.approx(off * JUMP)
        assert watched.slip[encoder] == pytest.approx(off * JUMP)
        assert watched.believed[encoder] == pytest.approx(watched.past[0, encoder] + foretold)
        assert watched.probation[encoder] == 20


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_after_its_probation_it_is_where_friction_may_have_let_it_or_lost(
    encoder: int, way: float
) -> None:
    """In 20 samples friction, of the tilts too, moves it so far off what the model foretells."""
    friction = (0.8, 0.35, 0.4, 3.0, 5.0)
    tilt = PARAMETERS.machine.radius * friction[3 + encoder % 2]
    held = friction[0] + tilt if encoder < 4 else friction[encoder - 3]
    drift = 0.5 * held * (20 * T) ** 2
    for share, left in ((0.99, PUT_RIGHT), (1.01, LOST)):
        hover = Hover()
        hover.watched.friction[:] = friction
        hover.length[encoder] += 3e-4
        hover.sample()
        creep = way * share * (JUMP + drift) / 19
        for number in range(1, 20):
            assert hover.watched.probation[encoder] == 20 - number
            hover.length[encoder] += creep
            hover.sample()
            if number < 19:
                assert hover.watched.trust[encoder] == PUT_RIGHT
        assert hover.watched.trust[encoder] == left


@pytest.mark.parametrize('encoder', range(6))
def test_what_leaps_again_is_done_without(encoder: int) -> None:
    hover = Hover()
    for lost in ([], [encoder]):
        hover.length[encoder] += 3e-4
        assert hover.sample() == (guard.JUMP, encoder)
        assert (hover.watched.trust[encoder] == LOST) == bool(lost)
    hover.length[encoder] += 3e-4
    assert hover.sample()[0] == guard.FINE  # nobody looks at it any more


@pytest.mark.parametrize('encoder', [4, 5])
@pytest.mark.parametrize('other', [SOUND, PUT_RIGHT, LOST, NOISY])
@pytest.mark.parametrize('counts', [False, True])
def test_x_and_z_that_both_leap_again_and_again_are_better_than_nothing(
    encoder: int, other: int, counts: bool
) -> None:
    """Where it counts; what was put right before is taken back."""
    watched = Hover().watched
    watched.trust[encoder], watched.trust[9 - encoder] = PUT_RIGHT, other
    watched.probation[encoder], watched.offset[encoder], watched.slip[encoder] = 7, 5e-4, 3e-4
    watched.step[encoder] = 0.0 if counts else 3e-4
    watched.past[1, encoder] = watched.past[0, encoder] - 3e-4
    read = watched.past[0, encoder] + (2e-4 if counts else 0.0)
    watched.believed[:] = watched.past[0] + watched.step
    watched.believed[encoder] = read
    assert find_leaps(watched.block[0])
    if other == SOUND or not counts:
        assert watched.trust[encoder] == LOST
        return
    assert watched.trust[encoder] == NOISY
    assert watched.probation[encoder] == 0
    assert watched.offset[encoder] == pytest.approx(2e-4)
    assert watched.believed[encoder] == pytest.approx(watched.past[0, encoder])


@pytest.mark.parametrize(
    ('error', 'believed'),
    [(1e-4, 2e-5), (-1e-4, -2e-5), (1.49e-3, 2.98e-4), (-1.49e-3, -2.98e-4), (1.51e-3, 0.0)],
)
def test_of_what_is_noisy_a_fifth_is_believed_and_nothing_far_off(
    error: float, believed: float
) -> None:
    watched = Hover().watched
    watched.trust[4] = NOISY
    watched.step[4] = 1e-5
    watched.believed[:] = watched.past[0] + watched.step
    watched.believed[4] += error
    assert not find_leaps(watched.block[0])
    assert watched.believed[4] == pytest.approx(1e-5 + believed, abs=1e-12)
    np.testing.assert_array_equal(watched.blamed, 0)
