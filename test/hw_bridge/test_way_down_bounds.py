"""The bridge's landing where a bound is just reached, and who carries what is not seen."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from maglev_hw_bridge.faults import consequence_of_cut
from maglev_hw_bridge.landing import Landing, impact_of_cut, impacts_of_cut
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.guard import Guard
from maglev_model.axes import PHI, THETA, X, Z
from maglev_model.parameters import build

PARAMETERS = BridgeParameters()
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
LOW = np.array([0.030, 0.0, 0.0, 0.0, 0.0])
REST = np.zeros(5)


def begun(place: np.ndarray, blind: np.ndarray | None = None) -> Landing:
    landing = Landing(PARAMETERS)
    landing.begin(place, REST, np.zeros(5, bool) if blind is None else blind)
    return landing


def test_of_what_is_not_seen_x_and_z_decide_before_the_tilts_who_carries() -> None:
    for unseen in itertools.product([False, True], repeat=4):
        blind = np.array([False, *unseen])
        along = int(blind[Z]) - int(blind[X])
        side = along or int(blind[THETA]) - int(blind[PHI])
        assert begun(HOVER, blind).arrays.along_z == 0.5 + 0.5 * side


@pytest.mark.parametrize('axis', [X, Z])
def test_what_moves_as_fast_as_it_may_hardly_move_is_braked(axis: int) -> None:
    rate = REST.copy()
    rate[axis] = 2e-3
    landing = Landing(PARAMETERS)
    landing.begin(HOVER, rate)
    assert landing.arrays.speed[axis] == 2e-3


@pytest.mark.parametrize('axis', [X, Z])
def test_what_is_off_as_far_as_it_may_be_is_held_and_pushed(axis: int) -> None:
    landing = begun(HOVER)
    landing.arrays.stray[axis] = 5e-4  # and twice that where a cut throws it up
    away = HOVER.copy()
    away[axis] = 1e-3
    landing.step(away, REST, REST)
    assert not landing.astray
    landing = begun(HOVER)
    away[axis] = 2e-5
    landing.step(away, REST, REST)
    assert np.all(landing.quadrature_current[[1, 3] if axis == X else [0, 2]] != 0.0)


def test_at_the_balance_a_cut_does_not_throw_it_up() -> None:
    landing = begun(LOW)
    landing.arrays.balance = LOW[0]
    landing.arrays.stray[X] = 5e-4
    away = LOW.copy()
    away[X] = 6e-4
    landing.step(away, REST, REST)
    assert landing.astray


def test_unseen_it_is_over_below_the_place_from_which_a_cut_is_soft() -> None:
    landing = begun(LOW, np.arange(5) == X)
    assert landing.arrays.end == PARAMETERS.machine.gap_max - 5e-5
    landing.arrays.end = LOW[0]
    assert not landing.step(LOW, REST, REST)


@pytest.mark.parametrize(
    ('machine', 'fastest'),
    [
        ({}, 0.8093),
        ({'machine.gap_max': 0.044, 'fault.gap_upper': 0.05}, 1.1446),
        ({'machine.magnet_charge': 1e6}, 0.9656),
    ],
    ids=['default', 'twice the way', 'stronger magnets'],
)
def test_a_free_fall_from_anywhere_is_slower_than_a_speed_that_is_believed(
    machine: dict[str, float], fastest: float
) -> None:
    """By the hardest pull over all of the way."""
    of = build(BridgeParameters, machine)
    nothing = impacts_of_cut(of, 0.025, np.nan)
    assert impacts_of_cut(of, 0.025, fastest + 2e-4) == nothing
    assert impacts_of_cut(of, 0.025, fastest) != nothing
    for start in (of.machine.gap_max - 1e-6, 0.0287, 0.028):
        assert impact_of_cut(of, start, 0.0, 1.1)[0] < fastest


@pytest.mark.parametrize(('above', 'waits'), [(1.9e-4, False), (2.1e-4, True)])
@pytest.mark.parametrize('axis', [PHI, THETA])
@pytest.mark.parametrize('way', [-1.0, 1.0])
def test_what_is_almost_down_may_hardly_turn(
    way: float, axis: int, above: float, *, waits: bool
) -> None:
    """By an amplifier that is stuck on it turns ever faster, and a cut is soft yet."""
    place = np.array([PARAMETERS.machine.gap_max - above, 0.0, 0.0, 0.0, 0.0])
    landing = begun(place)
    rate = REST.copy()
    for share in (0.99, 1.01):
        rate[axis] = way * share * 0.08
        landing.step(place, rate, REST)
        assert landing.astray == (share > 1.0 and not waits)


@pytest.mark.parametrize('axis', [PHI, THETA])
@pytest.mark.parametrize(
    ('turning', 'told'),
    [
        (0.0, ['lower stop at about 0.0']),
        (0.01, ['lower stop at about 0.0']),
        (-0.3, ['upper stop at about 0.4', 'lower stop at about 0.0']),
        (0.3, ['upper stop at about 0.4', 'lower stop at about 0.0']),
    ],
)
def test_what_turns_may_rise_though_it_hangs_near_its_lower_stop(
    axis: int, turning: float, told: list[str]
) -> None:
    """An amplifier that was stuck on has thrown it over the stop's edge: told as it may end."""
    guard = Guard(PARAMETERS)
    guard.arrays.position[:] = [PARAMETERS.machine.gap_max - 1e-4, 0.0, 0.0, 0.0, 0.0]
    guard.arrays.rate[axis] = turning
    parts = consequence_of_cut(PARAMETERS, guard).removeprefix('; the platen strikes the ')
    found = parts.split(' or the ')
    assert len(found) == len(told)
    assert all(one.startswith(start) for one, start in zip(found, told, strict=True)), parts
