"""At lift-off the gap encoders are called by roll."""

from __future__ import annotations

import numpy as np
import pytest
from hovering import PARAMETERS, hovering

from maglev_hw_bridge.sensing import observer
from maglev_hw_bridge.sensing.guard_arrays import LOST, PUT_RIGHT, SOUND
from maglev_hw_bridge.sensing.standing_still import (
    await_lift_off,
    call_the_roll,
)
from maglev_model.axes import PHI, THETA, X, Y, Z

STOP = PARAMETERS.machine.gap_max


@pytest.mark.parametrize(('y', 'answered'), [(0.025, 1), (STOP - 1e-4, 0)])
def test_on_the_ground_the_roll_waits_for_who_has_left_the_stop(y: float, answered: int) -> None:
    for way in (await_lift_off, lambda g: call_the_roll(g, False, np.ones(6, bool))):
        watched = hovering()
        watched.position[Y] = y
        watched.answered[:], watched.left[:] = 7, 1.0
        assert not way(watched.block[0])
        assert watched.answered.tolist() == [answered] * 4
        assert not watched.left.any()


@pytest.mark.parametrize('caller', range(4))
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_who_has_not_counted_when_another_has_left_is_done_without(caller: int, way: float) -> None:
    """The roll is called when one that is sound has gone 35 um, in steps less than that."""
    watched = hovering()
    watched.answered[:] = 0
    watched.disturbance[:] = 9.0
    quiet = (caller + 1) % 4
    gone = [1.7e-5, 1.7e-5, 0.9e-5]  # 34 um, then 43
    for number, step in enumerate(gone):
        counted = np.array([i != quiet for i in range(6)])
        watched.past[0] = watched.believed
        watched.believed[caller] += way * step
        found = call_the_roll(watched.block[0], True, counted)
        assert found is (number == 2)
    assert watched.trust.tolist() == [LOST if i == quiet else SOUND for i in range(6)]
    assert watched.blamed.tolist() == [int(i == quiet) for i in range(6)]
    assert watched.disturbance[[PHI, THETA]].tolist() == [0.0, 0.0]
    assert watched.disturbance[[Y, X, Z]].tolist() == [9.0] * 3
    watched.blamed[:] = 0
    assert not call_the_roll(watched.block[0], True, np.zeros(6, bool))  # it is lost already
    assert not watched.blamed.any()


@pytest.mark.parametrize('why', ['all answered', 'it leapt', 'put right'])
def test_nobody_is_missed_without_a_reason(why: str) -> None:
    watched = hovering()
    watched.answered[:] = 1 if why == 'all answered' else [1, 0, 1, 1]
    watched.left[0] = 3.4e-5
    watched.trust[0] = PUT_RIGHT if why == 'put right' else SOUND
    watched.believed[0] += 3.6e-5 if why == 'it leapt' else 1e-5
    assert not call_the_roll(watched.block[0], True, np.arange(6) == 0)
    assert watched.trust[1] == SOUND
    assert watched.left[0] == pytest.approx(0.0 if why == 'it leapt' else 4.4e-5)


def test_a_bound_that_is_just_reached_is_not_yet_passed() -> None:
    """35 um in a millisecond: a step that is a leap; and of the way that calls the roll."""
    watched = hovering()
    watched.answered[:] = 0
    watched.past[0, 0], watched.believed[0], watched.left[0] = 0.0, 1e-3 * 0.035, 1e-6
    assert not call_the_roll(watched.block[0], True, np.arange(6) == 0)
    assert watched.left[0] == 0.0
    watched.past[0, 0], watched.left[0] = watched.believed[0], PARAMETERS.fault.roll_call
    assert not call_the_roll(watched.block[0], True, np.arange(6) == 0)
    watched.left[0] = np.nextafter(watched.left[0], 1.0)
    assert call_the_roll(watched.block[0], True, np.arange(6) == 0)


@pytest.mark.parametrize('quiet', range(4))
@pytest.mark.parametrize(
    ('across', 'left', 'right', 'silent', 'lost'),
    [
        (-4e-5, -2e-5, -2e-5, 0, False),  # it turns about that corner
        (-4e-5, -3.7e-5, -3.7e-5, 0, False),
        (-4e-5, -3.8e-5, -3.8e-5, 0, True),  # by the other three it is 36 um off the stop
        (-4e-5, 1e-6, -1e-6, 0, True),  # or below it
        (-4e-5, 0.0, -4e-5, 1, True),  # two may be stuck
        (-4e-5, 0.0, -4e-5, 0, False),
    ],
)
def test_who_has_not_moved_as_the_other_three_tell_is_not_missed(
    quiet: int, across: float, left: float, right: float, silent: int, lost: bool
) -> None:
    watched = hovering()
    watched.past[0] = watched.believed
    watched.answered[:] = 1
    watched.answered[quiet] = 0
    watched.answered[(quiet + 1) % 4] = 1 - silent
    for k, gone in ((1, left), (2, across), (3, right)):
        watched.left[(quiet + k) % 4] = gone
    assert call_the_roll(watched.block[0], True, np.zeros(6, bool)) == lost
    assert (watched.trust[quiet] == LOST) == lost


@pytest.mark.parametrize('k', [1, 2, 3])
def test_who_is_lost_cannot_excuse_another(k: int) -> None:
    watched = hovering()
    watched.past[0] = watched.believed
    watched.left[:] = -4e-5
    watched.answered[:], watched.left[2] = [0, 1, 1, 1], -8e-5
    watched.trust[k] = LOST
    assert call_the_roll(watched.block[0], True, np.zeros(6, bool))
    assert watched.trust[0] == LOST


@pytest.mark.parametrize('lost', [[], [1], [0, 1, 2]])
def test_none_of_them_has_told_of_a_platen_that_has_risen_for_sure(lost: list[int]) -> None:
    """By the bound to the last bit, of which ``lost`` ones say nothing."""
    left = [i for i in range(4) if i not in lost]
    watched = hovering()
    watched.answered[:], watched.rested = 0, True
    watched.trust[lost], watched.answered[lost] = LOST, 1
    watched.unseen[:4] = -1.0
    watched.unseen[left[-1]] = PARAMETERS.fault.roll_call
    nobody = np.zeros(6, bool)
    assert not call_the_roll(watched.block[0], True, nobody)
    watched.unseen[left[-1]] = np.nextafter(PARAMETERS.fault.roll_call, 1.0)
    assert call_the_roll(watched.block[0], True, nobody)
    assert np.flatnonzero(watched.trust == LOST).tolist() == [0, 1, 2, 3]
    assert np.flatnonzero(watched.blamed).tolist() == left
    assert not call_the_roll(watched.block[0], True, nobody)


@pytest.mark.parametrize('why', ['one answered', 'it is not known', 'on the ground'])
def test_or_one_has_or_nobody_knows_whether_it_has(why: str) -> None:
    watched = hovering()
    watched.answered[:], watched.rested = 0, why != 'it is not known'
    watched.answered[2] = int(why == 'one answered')
    watched.unseen[:4] = -1.0
    assert not call_the_roll(watched.block[0], why != 'on the ground', np.zeros(6, bool))
    assert not watched.trust.any()


@pytest.mark.parametrize('y', [0.025, STOP - 1e-4])
@pytest.mark.parametrize('rises_at', [np.nan, -0.7])
def test_while_it_rests_what_it_rises_at_is_what_the_model_is_off_by(
    y: float, rises_at: float
) -> None:
    watched = hovering()
    watched.position[Y], watched.rises_at, watched.rested = y, rises_at, True
    watched.disturbance[Y] = watched.disturbance_then[Y] = 3.0
    await_lift_off(watched.block[0])
    known = y > 0.03 and not np.isnan(rises_at)
    assert watched.disturbance[Y] == watched.disturbance_then[Y] == (0.7 if known else 3.0)
    assert bool(watched.rested) is (known or y < 0.03)


def test_what_hangs_on_the_upper_stop_does_not_rest() -> None:
    """What lifts it off the lower one says nothing there."""
    watched = hovering()
    watched.position[Y], watched.rises_at = PARAMETERS.machine.gap_min + 1e-4, -0.7
    await_lift_off(watched.block[0])
    assert not watched.rested
    observer.start(watched.block[0], np.array([*[watched.position[Y]] * 4, 0.0, 0.0]))
    assert not watched.rested
    assert watched.disturbance[Y] == 0.0
    observer.start(watched.block[0], np.array([*[STOP - 1e-4] * 4, 0.0, 0.0]))
    assert watched.rested
    assert watched.disturbance[Y] == 0.7
