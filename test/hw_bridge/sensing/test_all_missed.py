"""Gap encoders of which none tells of a motion; who is judged before the disturbance is found."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import PARAMETERS, hovering

from maglev_hw_bridge.sensing.guard_arrays import LOST
from maglev_hw_bridge.sensing.standing_still import UNSEEN, find_stuck, look
from maglev_model.axes import PHI, THETA, X, Y, Z

GAP, HORIZONTAL = PARAMETERS.fault.stuck_gap, PARAMETERS.fault.stuck_horizontal
GAPS = [0, 1, 2, 3]
NEAR_ITS_STOP = PARAMETERS.machine.gap_max - 1e-4
VERTICAL = [Y, PHI, THETA]


@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_all_are_stuck_by_half_of_what_one_is(way: float) -> None:
    """To the last bit."""
    for unseen, found in ((0.5 * GAP, []), (np.nextafter(0.5 * GAP, 1.0), GAPS)):
        watched = hovering()
        watched.unseen[:4] = way * unseen
        assert find_stuck(watched.block[0], np.arange(6) < 4, UNSEEN) is bool(found)
        assert np.flatnonzero(watched.trust == LOST).tolist() == found


@pytest.mark.parametrize('sound', GAPS)
@pytest.mark.parametrize('x', [False, True])
def test_but_not_where_one_has_told_of_it(sound: int, x: bool) -> None:
    watched = hovering()
    watched.rigid, watched.unseen[:4] = False, 0.99 * GAP  # so that none denies it
    doubted = (np.arange(6) < 4 + x) & (np.arange(6) != sound)
    assert not find_stuck(watched.block[0], doubted, UNSEEN)
    assert not watched.trust.any()


@pytest.mark.parametrize(
    ('y', 'rested', 'share'),
    [(0.025, False, 0.5), (NEAR_ITS_STOP, False, 1.0), (NEAR_ITS_STOP, True, 0.5)],
)
def test_nor_where_nobody_knows_what_the_lower_stop_carries(
    y: float, rested: bool, share: float
) -> None:
    for unseen, found in ((0.99 * share, []), (1.01 * share, GAPS)):
        watched = hovering()
        watched.position[Y], watched.rested = y, rested
        watched.unseen[:4] = unseen * GAP
        assert find_stuck(watched.block[0], np.arange(6) < 4, UNSEEN) is bool(found)
        assert np.flatnonzero(watched.trust == LOST).tolist() == found


@pytest.mark.parametrize('encoder', [4, 5])
def test_x_and_z_are_missed_as_long_whatever_gaps_do(encoder: int) -> None:
    for share in (0.99, 1.01):
        watched = hovering()
        watched.unseen[encoder] = share * HORIZONTAL
        assert find_stuck(watched.block[0], np.ones(6, bool), UNSEEN) is (share > 1.0)
        assert bool(watched.trust[encoder] == LOST) is (share > 1.0)


@pytest.mark.parametrize(
    ('settled', 'rested', 'judged'),
    [
        (True, False, range(6)),
        (True, True, range(6)),
        (False, True, range(4)),  # of the gaps all is known that has to be
        (False, False, []),
    ],
)
def test_who_is_missed_before_the_disturbance_is_found(
    settled: bool, rested: bool, judged: range
) -> None:
    watched = hovering()
    watched.samples, watched.rested = watched.settling - (not settled), rested
    watched.least_rate[:] = [0.01, 0.02, 0.03, 0.0, 0.0]
    look(watched.block[0], True, np.empty(6, np.bool_))
    step = PARAMETERS.sample_time * np.array([0.01] * 4 + [0.02, 0.03])
    wanted = [step[i] if i in judged else 0.0 for i in range(6)]
    np.testing.assert_allclose(watched.unseen, wanted, atol=1e-12)


@pytest.mark.parametrize('settled', [False, True])
@pytest.mark.parametrize('rested', [False, True])
def test_until_then_the_model_begins_anew_with_what_is_known_of_y_and_the_tilts(
    settled: bool, rested: bool
) -> None:
    """But for what rests where the lift has shown at which push it rises."""
    watched = hovering()
    watched.samples, watched.rested = watched.settling - (not settled), rested
    watched.rate[:], watched.disturbance[:] = 1.0, 2.0
    for array in (watched.model_rate, watched.still_time, watched.disturbance_then):
        array[:] = 7.0
    look(watched.block[0], True, np.empty(6, np.bool_))
    anew = not (settled or rested)
    for array, known in (
        (watched.model_rate, 1.0),
        (watched.still_time, 0.0),
        (watched.disturbance_then, 2.0),
    ):
        assert array[VERTICAL].tolist() == [known if anew else 7.0] * 3
        assert array[[X, Z]].tolist() == [7.0] * 2
