"""What the guard sees of encoders whose count is longer than a platen's way in a sample."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import Hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import LOST, PUT_RIGHT
from maglev_hw_bridge.sensing.standing_still import call_the_roll, listen
from maglev_model.parameters import build


def hover(**changed: object) -> Hover:
    given = {name.replace('__', '.'): value for name, value in changed.items()}
    return Hover(parameters=build(BridgeParameters, given))


@pytest.mark.parametrize('period', [1e-4, 2.5e-4, 5e-4, 1e-3, 2e-3])
def test_a_gap_that_leaves_its_stop_by_single_counts_calls_the_roll(period: float) -> None:
    watched = hover(sample_time=period).watched
    watched.answered[:] = [1, 0, 1, 1]
    for _ in range(4):
        watched.past[0] = watched.believed
        watched.believed[0] -= 1e-5
        found = call_the_roll(watched.block[0], True, np.zeros(6, np.bool_))
    assert found
    assert watched.trust[1] == LOST


@pytest.mark.parametrize('period', [1e-4, 2.5e-4])
def test_two_counts_at_once_are_a_leap_where_no_platen_is_that_fast(period: float) -> None:
    watched = hover(sample_time=period).watched
    watched.answered[:] = 0
    watched.left[:] = 3.4e-5
    watched.past[0] = watched.believed
    watched.believed[0] -= 2e-5
    assert not call_the_roll(watched.block[0], True, np.zeros(6, np.bool_))
    assert watched.left.tolist() == [0.0] + [3.4e-5] * 3


def test_x_that_counts_one_way_after_all_is_believed_however_long_its_counts() -> None:
    watched = hover(sample_time=1e-4, encoder__resolution=(1e-5,) * 4 + (1e-4,) * 2).watched
    watched.trust[4], watched.stood[0], watched.heard[0] = LOST, 1, 0
    watched.read[0] = watched.believed[4]
    for _ in range(5):
        watched.believed[4] += 1e-4
        listen(watched.block[0])
    assert watched.returned
    assert watched.trust[4] == PUT_RIGHT


@pytest.mark.parametrize('period', [1e-4, 2.5e-4])
def test_a_slip_is_on_probation_for_20_ms_however_many_samples_that_are(period: float) -> None:
    stands = hover(sample_time=period)
    stands.length[4] += 3e-4
    assert stands.sample() == (guard.JUMP, 4)
    assert stands.watched.probation[4] == round(0.02 / period) - 1
