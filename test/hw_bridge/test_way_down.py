"""The law of the bridge's landing, retold with the model's own inverse, and what a cut would do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_motor import vertical_force
from scipy.integrate import solve_ivp

from maglev_hw_bridge.landing import Landing, impact_of_cut, impacts_of_cut
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import THETA, X, Y, Z
from maglev_model.currents import exact_currents
from maglev_model.inverse import CurrentLimits
from maglev_model.machine import machine_constants
from maglev_model.parameters import build
from maglev_model.platen import output_accelerations
from maglev_model.quintic import quintic_to_zero

PARAMETERS = build(BridgeParameters, {'landing.depth': 1e-4})
LAW = PARAMETERS.landing
MACHINE = machine_constants(PARAMETERS.machine)
T = PARAMETERS.sample_time
GAP_MIN, GAP_MAX = PARAMETERS.machine.gap_min, PARAMETERS.machine.gap_max

five = st.tuples(*[st.floats(-1.0, 1.0)] * 5).map(np.array)
flags = st.tuples(*[st.booleans()] * 5).map(np.array)
PLACE = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


def times(blind: np.ndarray) -> tuple[float, float]:
    """Of braking and descent [s]."""
    if blind[X] or blind[Z]:
        return LAW.blind_braking_time, LAW.adrift_descent_time
    if blind.any():
        return LAW.blind_braking_time, LAW.blind_descent_time
    return LAW.braking_time, LAW.descent_time


def way_at(
    time: float, begun: np.ndarray, brake: np.ndarray, level: np.ndarray, blind: np.ndarray
) -> np.ndarray:
    """Position, velocity, acceleration (3, 5) of the way down; ``begun``: where and how fast."""
    start, rate = begun
    braking, descent = times(blind)
    way = np.array(
        [quintic_to_zero(start[i] - level[i], rate[i], 0.0, brake[i], time) for i in range(5)]
    ).T
    way[0] += level
    if time >= braking:
        aim = GAP_MAX + LAW.depth
        way[:, 0] = quintic_to_zero(level[0] - aim, 0.0, 0.0, descent, time - braking)
        way[0, 0] += aim
    return way


@settings(max_examples=100)
@given(
    off=five,
    rate=five,
    later_off=five,
    later_rate=five,
    push=five,
    blind=flags,
    share=st.floats(0.0, 1.2),
)
def test_it_follows_a_smooth_way_by_position_and_rate(
    off: np.ndarray,
    rate: np.ndarray,
    later_off: np.ndarray,
    later_rate: np.ndarray,
    push: np.ndarray,
    blind: np.ndarray,
    share: float,
) -> None:
    """Braking over half of what the rate would cover, the tilts to 0, then down below the stop.

    Where y is not seen, down by a push instead.
    """
    start = PLACE + [2e-3, 5e-3, 5e-3, 5e-4, 1e-3] * off
    rate = rate * [0.01, 0.05, 0.05, 0.002, 0.01]
    landing = Landing(PARAMETERS)
    landing.begin(start, rate, blind)
    braking, descent = times(blind)
    moving = np.where([False, True, True, False, False] & (np.abs(rate) < 2e-3), 0.0, rate)
    brake = np.full(5, braking)
    brake[0] = min(braking, 0.1) if rate[0] < 0.0 else braking
    np.testing.assert_allclose(landing.arrays.braking, brake)  # far from all stops
    level = start + 0.5 * brake * moving
    level[3:] = 0.0
    number = max(1, round(share * (braking + descent) / T))
    landing.arrays.elapsed = (number - 1) * T
    time = landing.arrays.elapsed + T
    way, velocity, acceleration = way_at(time, np.array([start, moving]), brake, level, blind)
    position = way + [2e-4, 3e-5, 3e-5, 2e-4, 3e-4] * later_off
    speed = velocity + [0.01, 2e-3, 2e-3, 1e-3, 1e-3] * later_rate
    done = landing.step(position, speed, push)
    error, slip = way - position, velocity - speed
    wanted = acceleration + np.array(LAW.damping) * slip + np.array(LAW.stiffness) * error
    wanted -= np.where([True, False, False, True, True], push, 0.0)
    for axis in (X, Z):
        if abs(error[axis]) < 2e-5 and abs(velocity[axis]) + abs(speed[axis]) < 2e-3:
            wanted[axis] = 0.0
    place = position.copy()
    if blind[Y]:
        held = position[0] > GAP_MAX - 1e-3 and speed[0] >= 0.0
        place[0] = landing.arrays.balance if held else position[0]
        wanted[0] = (2.0 if held else 4.0) - push[0]
    carry = np.array([0.0, -2.0, 2.0, -1.0, 1.0])[blind].sum()
    limits = CurrentLimits(
        LAW.current,
        1.0,
        0.1,
        0.5 + 0.5 * float(np.clip(carry, -1.0, 1.0)),
        0.95 if position[0] < landing.arrays.balance else 0.5,
    )
    i_d, i_q, _ = exact_currents(MACHINE, place[None], wanted[None], limits)
    np.testing.assert_allclose(landing.direct_current, i_d[0], atol=1e-9)
    np.testing.assert_allclose(landing.quadrature_current, i_q[0], atol=1e-9)
    if blind[Y]:
        assert not landing.astray
        assert done == (time > 0.5)
        return
    sooner = (blind[X] or blind[Z]) and not blind[THETA] and position[0] > GAP_MAX - 5e-5
    assert done == (sooner or time > braking + descent + LAW.settle_time)


@pytest.mark.parametrize('seen', [True, False])
def test_it_is_over_after_braking_descent_and_settling(seen: bool) -> None:
    landing, blind = Landing(PARAMETERS), np.array([False, False, False, not seen, False])
    landing.begin(PLACE, np.zeros(5), blind)
    total = sum(times(blind)) + LAW.settle_time
    for off, over in ((-1.5, False), (0.5, True)):
        landing.arrays.elapsed = total + off * T
        assert bool(landing.step(PLACE, np.zeros(5), np.zeros(5))) is over


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize('side', [-1.0, 1.0])
def test_braking_ends_within_the_stops_and_the_soft_range(axis: int, side: float) -> None:
    """The narrower of both; near them as soon as a platen can be braked at all."""
    fault, machine = PARAMETERS.fault, PARAMETERS.machine
    low = max(machine.lower_limit[axis], fault.lower[axis])
    high = min(machine.upper_limit[axis], fault.upper[axis])
    end, room = (high, 1e-4) if side > 0.0 else (low, 1e-4)
    start, rate = PLACE.copy(), np.zeros(5)
    start[axis] = end - side * room
    rate[axis] = side * 0.05
    landing = Landing(PARAMETERS)
    landing.begin(start, rate)
    assert landing.arrays.level[axis] == pytest.approx(end if axis < 3 else 0.0, abs=1e-12)
    assert landing.arrays.braking[axis] == pytest.approx(0.05)


@pytest.mark.parametrize('y', [0.019, 0.025, 0.0285, 0.0289, 0.0305])
@pytest.mark.parametrize('speed', [-0.1, 0.0, 0.1])
@pytest.mark.parametrize('pull', [0.9, 1.0, 1.1])
def test_a_cut_strikes_as_an_adaptive_integrator_has_it(
    y: float, speed: float, pull: float
) -> None:
    """By (2), (6) with the magnets alone, ``pull`` times as strong."""
    zero = np.zeros(4)

    def moves(_: float, state: np.ndarray) -> list[float]:
        plain = output_accelerations(MACHINE, state[0], 0.0, 0.0, zero, zero)[0]
        return [state[1], MACHINE.G - pull * (MACHINE.G - plain)]

    def ends(_: float, state: np.ndarray) -> float:
        return float((state[0] - GAP_MIN) * (GAP_MAX - state[0]))

    ends.terminal = True  # type: ignore[attr-defined]
    flown = solve_ivp(moves, (0.0, 5.0), [y, speed], events=ends, rtol=1e-9, atol=1e-12)
    struck, stop = impact_of_cut(PARAMETERS, y, speed, pull)
    assert stop == ('upper' if flown.y[0, -1] < 0.025 else 'lower')
    assert struck == pytest.approx(abs(flown.y[1, -1]), abs=3e-3)


@pytest.mark.parametrize(('y', 'stop'), [(0.0, 'upper'), (GAP_MIN, 'upper'), (1.0, 'lower')])
def test_what_is_at_a_stop_or_beyond_strikes_it_as_it_moves(y: float, stop: str) -> None:
    assert impact_of_cut(PARAMETERS, y, 0.2) == (0.2, stop)


@settings(max_examples=60)
@given(y=st.floats(0.0185, 0.0308), speed=st.floats(-0.69, 0.69))
def test_what_a_cut_may_do_is_told_of_each_stop_the_harder_first(y: float, speed: float) -> None:
    """As it is believed; and with the place, the speed and the magnets off by what they may be."""
    doubt = 5e-3 + 0.1 * abs(speed)
    away = 2e-4 + (abs(speed) + doubt) * PARAMETERS.boards.watchdog
    up = impact_of_cut(PARAMETERS, y - away, speed - doubt, 1.1)
    down = impact_of_cut(PARAMETERS, y + away, speed + doubt, 0.9)
    likely = impact_of_cut(PARAMETERS, y, speed)
    told = impacts_of_cut(PARAMETERS, y, speed)
    assert set(told) == {up[1], down[1]} | {likely[1]}
    assert list(told.values()) == sorted(told.values(), reverse=True)
    assert told[likely[1]] == likely[0]
    for struck, stop in (up, down):
        assert stop == likely[1] or told[stop] == struck


@pytest.mark.parametrize('speed', [0.82, -0.82, math.nan, math.inf])
def test_a_speed_that_cannot_be_says_nothing(speed: float) -> None:
    """As at rest, but 0.1 m/s off."""
    told = impacts_of_cut(PARAMETERS, 0.0285, speed)
    away = 2e-4 + 0.1 * PARAMETERS.boards.watchdog
    likely, stop = impact_of_cut(PARAMETERS, 0.0285, 0.0)
    assert told[stop] == likely
    other = 'lower' if stop == 'upper' else 'upper'
    side = 1.0 if other == 'lower' else -1.0
    expected = impact_of_cut(PARAMETERS, 0.0285 + side * away, side * 0.1, 1.0 - side * 0.1)
    assert (told.get(other), other) == expected


# -- one thing at a time ---------------------------------------------------------------------------


def test_rising_it_brakes_sooner_than_falling() -> None:
    landing = Landing(BridgeParameters())
    middle = np.array([0.0245, 0.0, 0.0, 0.0, 0.0])
    for speed, time in ((-0.01, 0.1), (0.01, 0.3)):
        landing.begin(middle, np.array([speed, 0.0, 0.0, 0.0, 0.0]))
        assert landing.arrays.braking[0] == pytest.approx(time)
        assert landing.arrays.level[0] == pytest.approx(middle[0] + 0.5 * time * speed)


@pytest.mark.parametrize(
    ('blind', 'carrying'),
    [(1, (1, 3)), (2, (0, 2)), (3, (1, 3)), (4, (0, 2))],
)
def test_what_is_not_seen_decides_which_motors_carry(blind: int, carrying: tuple[int, int]) -> None:
    landing = Landing(BridgeParameters())
    place, unseen = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.zeros(5, np.bool_)
    unseen[blind] = True
    landing.begin(place, np.zeros(5), unseen)
    landing.step(place, np.zeros(5), np.zeros(5))
    machine = machine_constants(BridgeParameters().machine)
    pull = [-vertical_force(machine, 0.025, i, 0.0) for i in landing.direct_current]
    assert sum(pull) == pytest.approx(machine.M_y * machine.G, rel=1e-3)
    assert sum(pull[i] for i in carrying) > 0.9 * sum(pull)
    assert landing.arrays.descent_start + landing.arrays.descent_time < 0.5


def pushed(position: np.ndarray, rate: np.ndarray, push: np.ndarray) -> np.ndarray:
    """Accelerations y, x, z that a landing begun at 25 mm makes there, one sample later."""
    landing = Landing(BridgeParameters())
    landing.begin(PLACE, np.zeros(5))
    landing.step(PLACE + position, rate, push)
    return np.array(
        output_accelerations(
            machine_constants(BridgeParameters().machine),
            PLACE[0] + position[0],
            0.0,
            0.0,
            landing.direct_current,
            landing.quadrature_current,
        )[:3]
    )


@pytest.mark.parametrize(
    ('blind', 'over'),
    [({1}, True), ({2}, True), ({1, 3}, True), ({1, 2, 4}, False), ({3}, False), (set(), False)],
)
def test_unseen_along_x_or_z_it_is_over_on_the_stop_itself(blind: set[int], over: bool) -> None:
    """Not with theta unknown too: the mean gap is there while the platen stands on an edge."""
    parameters = BridgeParameters()
    landing, position = Landing(parameters), np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    landing.begin(position, np.zeros(5), np.isin(np.arange(5), list(blind)))
    position[0] = parameters.machine.gap_max - 6e-5
    assert not landing.step(position, np.zeros(5), np.zeros(5))
    position[0] = parameters.machine.gap_max - 4e-5
    assert bool(landing.step(position, np.zeros(5), np.zeros(5))) is over


def test_what_the_model_does_not_explain_is_made_up_for_along_y_alone() -> None:
    made = pushed(np.zeros(5), np.zeros(5), np.array([1.5, 0.2, 0.2, 0.0, 0.0]))
    assert made == pytest.approx((-1.5, 0.0, 0.0), abs=0.01)


@pytest.mark.parametrize('axis', [1, 2])
@pytest.mark.parametrize(
    ('off', 'speed', 'wanted'),
    [(1.9e-5, 0.0, 0.0), (2.1e-5, 0.0, -0.0525), (0.0, 1.9e-3, 0.0), (0.0, 2.1e-3, -0.21)],
)
def test_x_and_z_that_stand_still_are_not_pushed(
    axis: int, off: float, speed: float, wanted: float
) -> None:
    unit = np.eye(5)[axis]
    made = pushed(off * unit, speed * unit, np.zeros(5))
    assert made[axis] == pytest.approx(wanted, abs=1e-6)


@pytest.mark.parametrize('axis', [1, 2])
@pytest.mark.parametrize(('speed', 'braked'), [(1.9e-3, 0.0), (2.1e-3, 3.15e-4)])
def test_what_hardly_moves_along_x_or_z_is_not_braked(
    axis: int, speed: float, braked: float
) -> None:
    landing = Landing(BridgeParameters())
    landing.begin(PLACE, speed * np.eye(5)[axis])
    assert landing.arrays.level[axis] == pytest.approx(braked)


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize('share', [-0.99, -1.01, 0.99, 1.01])
@pytest.mark.parametrize(('y', 'patience'), [(0.0286, 2.0), (0.0288, 1.0)])
def test_a_platen_that_is_not_held_on_its_way_is_noticed(
    axis: int, share: float, y: float, patience: float
) -> None:
    """Along x and z later where the magnets would pull it up when let go, at gaps below 28.7 mm."""
    landing = Landing(BridgeParameters())
    place = np.array([y, 0.0, 0.0, 0.0, 0.0])
    landing.begin(place, np.zeros(5))
    bound = (1e-3, 1e-3 * patience, 1e-3 * patience, 1.5e-3, 3e-3)[axis]
    landing.step(place + share * bound * np.eye(5)[axis], np.zeros(5), np.zeros(5))
    assert landing.astray == (abs(share) > 1.0)
    landing.begin(place, np.zeros(5))
    assert not landing.astray


@pytest.mark.parametrize('axis', [3, 4])
@pytest.mark.parametrize(('y', 'share'), [(0.0250, 0.95), (0.0295, 0.5)])
def test_a_tilt_may_take_more_of_the_attraction_where_a_cut_would_throw_it_up(
    axis: int, y: float, share: float
) -> None:
    parameters = BridgeParameters()
    landing, machine = Landing(parameters), machine_constants(parameters.machine)
    place = np.array([y, 0.0, 0.0, 0.0, 0.0])
    landing.begin(place, np.zeros(5))
    landing.step(place, np.zeros(5), 1e3 * np.eye(5)[axis])
    made = output_accelerations(
        machine, y, 0.0, 0.0, landing.direct_current, landing.quadrature_current
    )
    attraction = machine.M_y * (machine.G - made[0])
    assert abs(made[axis]) * machine.I_x / machine.r == pytest.approx(share * attraction, rel=1e-6)


def test_the_balance_is_where_magnets_carry_the_platen() -> None:
    balance = Landing(BridgeParameters()).arrays.balance
    zero, machine = np.zeros(4), machine_constants(BridgeParameters().machine)
    assert balance == pytest.approx(0.0287, abs=1e-4)
    for side in (-1e-5, 1e-5):
        fall = output_accelerations(machine, balance + side, 0.0, 0.0, zero, zero)[0]
        assert np.sign(fall) == np.sign(side)


# -- what a cut would do ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('y', 'speed', 'stops'),
    [
        (0.025, 0.0, ['upper']),
        (0.0265, 0.0, ['upper']),
        (0.0265, 0.03, ['upper', 'lower']),
        (0.0283, 0.0, ['upper', 'lower']),
        (0.0291, 0.0, ['upper', 'lower']),
        (0.0308, 0.0, ['lower']),
        (0.0308, -0.08, ['upper', 'lower']),
    ],
)
def test_near_the_balance_a_cut_may_end_at_either_stop(
    y: float, speed: float, stops: list[str]
) -> None:
    foretold = impacts_of_cut(BridgeParameters(), y, speed)
    assert list(foretold) == stops
    assert sorted(foretold.values(), reverse=True) == list(foretold.values())


@pytest.mark.parametrize('speed', [np.nan, np.inf, -5.5, -0.85, 0.85])
def test_a_speed_that_no_platen_has_is_not_foretold(speed: float) -> None:
    parameters = BridgeParameters()
    assert impacts_of_cut(parameters, 0.025, speed) == impacts_of_cut(parameters, 0.025, np.nan)
    assert max(impacts_of_cut(parameters, 0.025, speed).values()) < 0.6
    assert max(impacts_of_cut(parameters, 0.025, 0.9 * 0.75).values()) > 0.65


def test_where_nobody_knows_the_place_a_cut_is_foretold_from_midway_between_the_stops() -> None:
    parameters = BridgeParameters()
    for speed in (0.0, 0.1, np.nan):
        foretold = impacts_of_cut(parameters, np.nan, speed)
        assert foretold == impacts_of_cut(parameters, 0.0245, speed)
