"""Encoders that fail, one, two, all of a kind: found, blamed, and landed with what is left."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np
import pytest
from bridge_flight import Flight, ellipse, hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard, guard_arrays
from maglev_hw_bridge.stage import Mode
from maglev_model.contract.stage import StageError
from maglev_model.parameters import ParameterError

NOMINAL = 0.01  # [m/s]
DEGRADED = 0.05  # [m/s]
GAPS = (0, 1, 2, 3)
PAIRS = list(combinations(range(6), 2))


def airborne(target: Callable = ellipse, samples: int = 200, **overrides: object) -> Flight:
    flight = Flight(target, overrides)
    flight.run(samples)
    assert flight.stage.mode is Mode.FOLLOWING, flight.stage.fault
    flight.rig.forget_impact()
    return flight


def descending(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All four gaps move, x and z too."""
    rate = np.array([0.006, 0.03, -0.03, 0.0, 0.0])
    return np.array([0.0225, 0.0, 0.0, 0.0, 0.0]) + time * rate, rate, np.zeros(5)


def failed(flight: Flight) -> set[int]:
    return set(flight.stage.guard.failed)


def landed(flight: Flight, speed: float) -> None:
    flight.until_no_current()
    assert flight.stage.fault is not None
    assert not flight.stage.fault.cut
    assert flight.rig.impact <= speed
    assert flight.rig.state[0] == 0.031


@pytest.mark.parametrize('encoder', range(6))
def test_one_stuck_encoder_is_blamed_alone_and_the_platen_landed(encoder: int) -> None:
    flight = airborne(descending)
    flight.boards.stuck[encoder] = True
    flight.run(60)
    landed(flight, NOMINAL if encoder < 4 else DEGRADED)
    assert failed(flight) == {encoder}  # also after it was mended, and on the stop
    assert flight.detected is not None
    assert flight.detected - 200 <= 50
    assert 'is stuck' in str(flight.stage.fault)
    assert 'home again' not in str(flight.stage.fault)


@pytest.mark.parametrize('pair', PAIRS)
def test_two_stuck_encoders_are_blamed_alone_and_the_platen_landed(pair: tuple[int, int]) -> None:
    flight = airborne(descending)
    flight.boards.stuck[list(pair)] = True
    flight.run(100)
    landed(flight, DEGRADED)
    assert failed(flight) == set(pair)


def rising(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At rest on the lower stop for 50 ms, then 2 mm up."""
    above = min(2.0 * max(time - 0.05, 0.0) ** 2, 2e-3)
    return np.array([0.031 - above, 0.0, 0.0, 0.0, 0.0]), np.zeros(5), np.zeros(5)


@pytest.mark.parametrize('stuck', [s for n in (1, 2, 3) for s in combinations(GAPS, n)])
def test_a_gap_that_does_not_answer_at_lift_off_is_done_without(stuck: tuple[int, ...]) -> None:
    flight = Flight(rising)
    flight.boards.stuck[list(stuck)] = True
    while flight.stage.fault is None and flight.samples < 250:
        flight.step()
    assert flight.rig.state[0] > 0.031 - 1.5e-4
    landed(flight, NOMINAL)
    assert failed(flight) == set(stuck)


@pytest.mark.parametrize('encoder', GAPS)
def test_a_gap_is_called_until_it_has_counted(encoder: int) -> None:
    flight = Flight(rising)
    flight.run(250)
    state = flight.stage.guard.arrays
    assert flight.stage.fault is None
    assert np.all(state.answered == 1)
    state.left[:] = 1.5e-4  # it depends on how far the law overshoots
    flight.run(1)
    assert flight.stage.fault is None
    flight.boards.stuck[encoder] = True
    state.answered[encoder] = 0
    flight.run(1)
    assert failed(flight) == {encoder}


@pytest.mark.parametrize(('leap', 'called'), [(3.4e-5, True), (3.6e-5, False)])
def test_an_encoder_that_leaps_does_not_call_the_others(leap: float, called: bool) -> None:
    watched = guard.Guard(BridgeParameters())
    length, current = np.array([0.031] * 4 + [0.0, 0.0]), np.zeros(12)
    for flying in (False, False, False, True):
        watched.watch(length, current, flying)
    for step in (leap, 0.2e-5):
        length[1] -= step
        watched.watch(length, current, True)
    assert (watched.failed == [0, 2, 3]) == called
    assert watched.failed in ([0, 2, 3], [])


@pytest.mark.parametrize('pair', PAIRS)
@pytest.mark.parametrize('later', [0, 30, 150])
def test_two_slips_are_put_right_and_the_platen_landed(pair: tuple[int, int], later: int) -> None:
    flight = airborne(samples=120)
    flight.boards.jumps[pair[0]] += 24
    flight.run(later)
    flight.boards.jumps[pair[1]] -= 900
    flight.run(2)
    assert flight.stage.mode is Mode.LANDING
    landed(flight, DEGRADED)
    assert failed(flight) == set(pair)


def test_all_counters_reset_at_once_are_put_right() -> None:
    flight = airborne(samples=120)
    flight.boards.jumps[:] -= flight.boards.rig.counts()
    flight.run(2)
    landed(flight, DEGRADED)
    assert failed(flight) == set(range(6))


@pytest.mark.parametrize('encoder', range(6))
def test_noise_is_lost_after_its_second_leap(encoder: int) -> None:
    flight = airborne(samples=120)
    random = np.random.default_rng(encoder)
    for _ in range(40):
        flight.boards.jumps[encoder] = round(random.normal(0.0, 30.0))
        flight.run(1)
    assert flight.stage.guard.arrays.trust[encoder] == guard_arrays.LOST
    landed(flight, DEGRADED)
    assert failed(flight) == {encoder}


@pytest.mark.parametrize('counts', [6, 30, 80])
@pytest.mark.parametrize('gap', [(), (3,)])
def test_where_x_and_z_are_both_noisy_they_are_followed_slowly(
    gap: tuple[int, ...], counts: int
) -> None:
    """Without either, motors out of phase push the platen along before it is down."""
    flight = airborne(hover(0.0195, 0.004, -0.006))
    rng = np.random.default_rng(counts)
    noisy = [*gap, 4, 5]
    for _ in range(2500):
        flight.boards.jumps[noisy] = rng.integers(-counts, counts + 1, len(noisy))
        flight.run(1, controlled=flight.stage.mode is Mode.FOLLOWING)
        if flight.stage.mode is Mode.DISABLED:
            break
    assert {4, 5} <= failed(flight)
    assert flight.stage.mode is Mode.DISABLED
    assert flight.rig.impact <= DEGRADED
    assert np.all(np.abs(flight.rig.state[[2, 4]] - [0.004, -0.006]) < 2e-3)


@pytest.mark.parametrize('encoder', [4, 5])
def test_x_or_z_that_counts_after_all_is_believed_again(encoder: int) -> None:
    """As where the motors did not move it, but not the encoder was stuck: a phase that is dead."""
    flight = airborne(descending)
    flight.boards.stuck[encoder] = True
    while flight.stage.guard.failed != [encoder]:
        flight.step()
    flight.run(20)
    assert flight.stage.guard.arrays.trust[encoder] == guard_arrays.LOST
    flight.boards.stuck[encoder] = False
    flight.run(10)
    state, axis = flight.stage.guard.arrays, encoder - 3
    assert state.trust[encoder] == guard_arrays.PUT_RIGHT
    assert abs(state.position[axis] - flight.rig.state[2 * axis]) < 5e-5
    landed(flight, DEGRADED)
    assert abs(state.position[axis] - flight.rig.state[2 * axis]) < 5e-5


@pytest.mark.parametrize(
    ('steps', 'believed'),
    [
        ([1, 1, 1, 1, 1], True),
        ([1, 0, 1, 0, 0, 1, 1, 0, 1], True),
        ([-2, -2, -1, -3, -1], True),
        ([1, 1, 1, 1], False),
        ([1, 1, 1, 1, -1, 1, 1, 1, 1], False),
        ([60, 60, 60, 60, 60], False),
    ],
)
def test_a_lost_encoder_is_believed_by_counts_one_way(steps: list[int], believed: bool) -> None:
    watched = guard.Guard(BridgeParameters())
    length, current = np.array([0.031] * 4 + [0.0, 0.0]), np.zeros(12)
    for _ in range(4):
        watched.watch(length, current, False)
    watched.lose(4)
    for step in steps:
        length[4] += 1e-5 * step
        watched.watch(length, current, False)
    assert watched.returned == believed
    assert (watched.arrays.trust[4] == guard_arrays.PUT_RIGHT) == believed


def test_x_and_z_that_stop_counting_in_motion_are_not_followed_as_noisy_ones_are() -> None:
    flight = airborne()
    flight.boards.stuck[[4, 5]] = True
    while flight.stage.guard.failed != [4, 5]:
        flight.step()
    for _ in range(20):
        flight.step(False)
        assert guard_arrays.NOISY not in flight.stage.guard.arrays.trust
    assert list(flight.stage.guard.arrays.trust[4:]) == [guard_arrays.LOST, guard_arrays.LOST]


@pytest.mark.parametrize(('counts', 'found'), [(4, False), (9, True)])
@pytest.mark.parametrize('encoder', range(6))
def test_how_small_a_slip_is_found(encoder: int, counts: int, found: bool) -> None:
    flight = airborne(samples=120)
    flight.boards.jumps[encoder] += counts
    flight.run(20)
    assert (flight.stage.fault is not None) == found
    assert flight.stage.guard.arrays.offset[encoder] == pytest.approx(found * 9e-5, abs=2e-5)


def test_small_slips_that_add_up_are_a_contradiction_and_land() -> None:
    flight = airborne(hover(0.025))
    for _ in range(5):
        flight.boards.jumps[1] += 4
        flight.run(20)
        assert flight.stage.fault is None
    flight.boards.jumps[1] += 4
    flight.run(5)
    assert 'contradict' in str(flight.stage.fault)
    landed(flight, DEGRADED)


def test_all_gaps_frozen_in_motion_are_found_within_30_ms_and_pushed_down() -> None:
    flight = airborne(descending)
    flight.boards.stuck[:4] = True
    flight.run(30)
    assert 'pushed down unseen' in str(flight.stage.fault)
    assert failed(flight) == set(GAPS)
    landed(flight, 0.25)
    assert not np.any(flight.boards.volts)


def test_what_fails_during_a_landing_is_named_once_beside_what_it_lands_for() -> None:
    flight = airborne(descending)
    flight.stage.stop()
    flight.run(20)
    flight.boards.stuck[2] = True
    landed(flight, NOMINAL)
    fault = flight.stage.fault
    assert fault is not None
    assert fault.kind == 'stop'
    first, *others = fault.reason.split('; then ')
    assert first == 'emergency stop'
    assert sum(other.startswith('encoder gap 3 is stuck') for other in others) == 1
    assert len(others) == len({other.split(' by ')[0] for other in others})
    assert 'check its cable' in fault.remedy


@pytest.mark.parametrize(('encoder', 'along_z'), [(4, 0.0), (5, 1.0)])
def test_x_or_z_that_fails_during_a_landing_is_done_without_and_it_is_over_sooner(
    encoder: int, along_z: float
) -> None:
    """Its own motors carry, which takes the least i_d of them, and a third of the time is left."""
    flight = airborne(descending)
    flight.stage.stop()
    flight.run(20)
    assert flight.stage.landing.arrays.along_z == 0.5
    flight.boards.stuck[encoder] = True
    while failed(flight) != {encoder}:
        flight.step(False)
    assert flight.stage.mode is Mode.LANDING
    assert flight.stage.landing.arrays.along_z == along_z
    lost = flight.samples
    while flight.stage.mode is Mode.LANDING:
        flight.step(False)
    assert flight.samples - lost < 500
    assert flight.rig.impact <= DEGRADED


def test_a_third_gap_during_the_landing_is_landed_and_the_fourth_cut() -> None:
    flight = airborne(descending)
    flight.boards.stuck[0] = True
    flight.run(40)
    assert flight.stage.mode is Mode.LANDING
    flight.boards.stuck[1] = True
    flight.run(250, controlled=False)
    assert failed(flight) == {0, 1}
    assert flight.stage.mode is Mode.LANDING
    flight.boards.stuck[2:4] = True
    flight.until_no_current()
    assert flight.stage.fault is not None


def test_after_a_reset_nothing_is_mended_and_the_zero_has_to_be_found_anew() -> None:
    flight = airborne(samples=120)
    flight.boards.jumps[4] += 40
    flight.run(2)
    landed(flight, DEGRADED)
    stage = flight.stage
    assert stage.reset() == (False, 'the cause is still there: encoder x lost counts: home again')
    stage.deactivate()
    with pytest.raises(StageError, match='a fault is latched: encoder x'):
        stage.activate()
    assert failed(flight) == {4}
    assert not stage.reset()[0]
    flight.rig.place(np.array([0.031, 0.0, 0.0, 0.0, 0.0]))
    flight.boards.jumps[4] -= 40
    flight.boards.tick()
    stage.home()
    assert failed(flight) == set()
    assert not np.any(stage.guard.arrays.offset)
    assert stage.reset()[0]
    stage.activate()


@pytest.mark.parametrize('error', [{}, {'K_v1': 1.1}, {'K_v1': 0.9, 'K_v2': 0.95}, {'K_h': 0.9}])
@pytest.mark.parametrize('rubbing', [0.3, 2.0])
def test_no_alarm_though_machine_and_friction_are_not_as_known(
    error: dict[str, float], rubbing: float
) -> None:
    coulomb = [rubbing * force for force in (0.303, 0.171, 0.149, 1.32, 1.32)]
    overrides: dict[str, object] = {f'emulation.offset.{k}': v for k, v in error.items()}
    flight = airborne(ellipse, 1500, **overrides, **{'emulation.guide.coulomb': coulomb})
    state = flight.stage.guard.arrays
    assert flight.stage.fault is None
    assert np.max(np.abs(state.position - flight.rig.state[::2])) < 5e-5


def test_the_observer_knows_position_rate_and_disturbance() -> None:
    push = {'emulation.disturbance.constant': [5.0, 4.0, -3.0, 0.0, 0.0]}
    flight = airborne(hover(0.025), 600, **push)
    state = flight.stage.guard.arrays
    machine = flight.stage.parameters.machine
    wanted = (5.0 / machine.mass_y, 4.0 / machine.mass_x, -3.0 / machine.mass_z)
    assert state.disturbance[:3] == pytest.approx(wanted, abs=0.35)  # friction holds as much
    assert state.position == pytest.approx(flight.rig.state[::2], abs=2e-5)
    assert state.rate == pytest.approx(flight.rig.state[1::2], abs=5e-3)


def test_a_landing_makes_up_for_a_disturbance() -> None:
    flight = airborne(hover(0.022), 400, **{'emulation.disturbance.constant': [15.0, 0, 0, 0, 0]})
    flight.stage.land('test')
    flight.until_no_current()
    assert flight.rig.impact <= 2.0 * NOMINAL


def test_friction_has_an_element_for_each_axis() -> None:
    with pytest.raises(ParameterError, match=r'fault\.friction'):
        airborne(**{'fault.friction': [0.5]})
