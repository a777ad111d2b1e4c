"""Every fault: seen in time, latched, made safe, and cleared only when its cause is gone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from bridge_flight import Flight, ellipse, hover

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import Mode
from maglev_model.contract.stage import StageError
from maglev_model.parameters import build

LOWER_STOP = 0.031
SOFT = 0.05  # [m/s]


def airborne(target: Callable = ellipse, samples: int = 300, **overrides: object) -> Flight:
    flight = Flight(target, overrides)
    flight.run(samples)
    assert flight.stage.mode is Mode.FOLLOWING, flight.stage.fault
    flight.rig.forget_impact()
    return flight


def landed(flight: Flight) -> None:
    flight.until_no_current()
    assert flight.rig.impact <= SOFT
    assert flight.rig.state[0] == LOWER_STOP
    assert np.max(np.abs(flight.rig.phase_current)) < 1e-6
    assert not np.any(flight.boards.volts)
    flight.stage.write(np.ones(4), np.ones(4))  # latched
    assert not np.any(flight.boards.volts)


def since(flight: Flight, do: Callable[[], None], samples: int) -> int:
    """Samples from an event to the latched fault."""
    do()
    start = flight.samples
    flight.run(samples)
    assert flight.stage.fault is not None, 'not detected'
    assert flight.detected is not None
    return flight.detected - start


def test_only_emulated_boards_are_patient() -> None:
    patience = {'emulation.patience': 0.04}
    emulated = build(BridgeParameters, patience).in_real_time()
    assert (emulated.fault.stale, emulated.boards.overrun, emulated.boards.watchdog) == (0.04,) * 3
    for driver in ('quanser', 'one_of_your_own'):
        real = build(BridgeParameters, {'driver': driver, **patience})
        assert real.in_real_time() == real
        assert (real.fault.stale, real.boards.overrun, real.boards.watchdog) == (0.005, 0.005, 0.02)


def test_without_fresh_currents_it_lands_within_5_ms() -> None:
    flight = airborne()
    for k in range(1, 6):
        flight.step(controlled=False)
        assert (flight.stage.fault is not None) == (k >= 5)
    assert flight.stage.fault is not None
    assert 'no fresh currents for 5 ms' in str(flight.stage.fault)
    landed(flight)


def test_no_fresh_currents_on_the_ground_are_no_fault() -> None:
    flight = Flight(hover(LOWER_STOP))
    for _ in range(50):
        flight.step(controlled=False)
    assert flight.stage.fault is None


@pytest.mark.parametrize('bad', [np.nan, -np.inf, 50.0])
@pytest.mark.parametrize('part', [0, 1])
def test_a_bad_command_is_refused_at_once(bad: float, part: int) -> None:
    flight = airborne(hover(0.022), 150)
    command = [np.full(4, 0.5), np.zeros(4)]
    command[part][2] = bad
    flight.stage.read()
    before = flight.boards.volts.copy()
    with pytest.raises(ValueError, match='motor 3'):
        flight.stage.write(*command)
    assert flight.stage.fault is not None
    assert flight.stage.mode is Mode.LANDING
    assert np.all(np.isfinite(flight.boards.volts))
    assert np.max(np.abs(flight.boards.volts - before)) < 2.0
    landed(flight)


def test_a_wrong_shape_is_refused_and_the_platen_stays_up() -> None:
    flight = airborne(hover(0.022), 150)
    with pytest.raises(ValueError, match='shape'):
        flight.stage.write(np.zeros(3), np.zeros(4))
    flight.run(50)
    assert flight.stage.fault is None


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('counts', [40, -400, 2**31 - 1])
def test_a_jumping_encoder_within_3_samples(encoder: int, counts: int) -> None:
    flight = airborne(samples=50)

    def jump() -> None:
        flight.boards.jumps[encoder] += counts

    assert since(flight, jump, 5) <= 3
    assert 'jumped' in str(flight.stage.fault)
    landed(flight)  # the other encoders tell where the platen is
    assert flight.stage.reset()[1].endswith('home again')


@pytest.mark.parametrize('encoder', range(6))
def test_a_stuck_encoder_under_motion_within_50_ms(encoder: int) -> None:
    # Z moves fastest now, x a quarter period later; theta moves gaps 2 and 4, y all four.
    flight = airborne(samples=180 if encoder == 4 else 320)

    def stick() -> None:
        flight.boards.stuck[encoder] = True

    assert since(flight, stick, 60) <= 50
    assert flight.stage.fault is not None
    assert flight.stage.fault.kind == 'encoder'
    landed(flight)


def test_a_raw_step_is_not_being_stuck() -> None:
    flight = airborne(hover(0.025), 50)
    for axis, size in ((1, 0.03), (2, 0.03), (1, 0.0), (2, -0.02)):
        position = flight.target(0.0)[0].copy()
        position[axis] = size
        flight.target = hover(*position)
        flight.run(700)
        assert flight.stage.fault is None, flight.stage.fault


def test_resting_still_is_not_being_stuck() -> None:
    flight = airborne(hover(0.025), 1500)
    assert flight.stage.fault is None


def test_a_lost_count_is_no_fault_but_many_are_within_3_samples() -> None:
    flight = airborne(hover(0.025), 100)
    flight.boards.jumps[1] += 1
    flight.run(20)
    assert flight.stage.fault is None

    def slip() -> None:
        flight.boards.jumps[1] += 24

    assert since(flight, slip, 5) <= 1
    assert 'gap 2 jumped' in str(flight.stage.fault)
    landed(flight)


@pytest.mark.parametrize(
    ('name', 'bounds'),
    [('y', (0.0225, 0.03)), ('x', (-0.02, 0.02)), ('z', (-0.02, 0.02)), ('theta', (-0.006, 0.006))],
)
def test_out_of_the_soft_range_at_the_same_sample(name: str, bounds: tuple[float, float]) -> None:
    axis = ('y', 'x', 'z', 'phi', 'theta').index(name)
    lower = [0.0183, -0.048, -0.048, -0.0028, -0.0135]
    upper = [0.0313, 0.048, 0.048, 0.0028, 0.0135]
    start, _, _ = ellipse(0.11)
    lower[axis], upper[axis] = bounds
    if not bounds[0] < start[axis] < bounds[1]:
        lower[axis] = -0.05 if axis else 0.018
    flight = Flight(lambda t: ellipse(t + 0.11), {'fault.lower': lower, 'fault.upper': upper})
    while flight.stage.fault is None:
        flight.step()
        value = flight.stage.guard.arrays.position[axis]
        assert (flight.stage.fault is not None) == (not lower[axis] <= value <= upper[axis])
        assert flight.samples < 2000
    assert f'{name} is' in str(flight.stage.fault)


@pytest.mark.parametrize(('axis', 'rate'), [(3, 0.02), (3, -0.02), (4, 0.05), (4, -0.05)])
def test_a_gap_out_of_its_soft_range_is_named_at_the_same_sample(axis: int, rate: float) -> None:
    """By a tilt [rad/s], while y stays where it is."""

    def tilting(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        way = rate * np.eye(5)[axis]
        return 0.025 * np.eye(5)[0] + time * way, way, np.zeros(5)

    flight = Flight(tilting, {'fault.gap_lower': 0.0248})
    while flight.stage.fault is None:
        flight.step()
        gap = flight.stage.guard.arrays.past[0, :4]
        assert (flight.stage.fault is not None) == bool(np.min(gap) < 0.0248)
        assert flight.samples < 500
    lowest = int(np.argmin(gap))
    reason = f'gap {lowest + 1} is {1e3 * gap[lowest]:.3f} mm, outside its soft range'
    assert flight.stage.fault.reason == reason
    landed(flight)


def test_too_great_a_phase_current_at_the_same_sample() -> None:
    flight = airborne(hover(0.025), 100, **{'fault.over_current': 8.0})
    flight.stage.read()
    with pytest.raises(ValueError, match='phase'):
        flight.stage.write(np.full(4, 9.0), np.zeros(4))
    landed(flight)


def test_a_spent_budget_warns_then_derates_then_trips() -> None:
    locked = {
        'emulation.guide.locked': [True] * 5,
        'fault.friction': [1000.0] * 5,  # holds as the locks do
        'amplifier.thermal_time': 0.2,
    }
    flight = Flight(hover(LOWER_STOP), locked)
    amplifier = flight.stage.amplifiers
    seen = []
    for _ in range(2000):
        flight.stage.read()
        flight.stage.write(np.full(4, 6.9), np.zeros(4))
        seen.append((amplifier.load, amplifier.warm, float(np.max(np.abs(amplifier.volts)))))
        if flight.stage.fault is not None:
            break
    load, warm, current = np.array(seen[:-1]).T
    assert np.all(warm == (load >= 0.7))
    assert np.all(current[load < 0.85] == 6.9)
    assert np.all(np.diff(current) <= 1e-12)
    assert current[-1] == pytest.approx(5.0)
    assert load[-1] < 0.98
    assert 'I2t budget (load 0.98)' in str(flight.stage.fault)
    assert not np.any(flight.boards.volts)
    ok, why = flight.stage.reset()
    assert not ok
    assert 'hot' in why


def test_a_board_error_at_the_next_sample() -> None:
    flight = airborne()
    flight.boards.failing = True
    with pytest.raises(StageError, match='does not answer'):
        flight.stage.read()
    assert flight.stage.mode is Mode.LOST
    assert flight.stage.fault is not None
    ok, why = flight.stage.reset()
    assert not ok
    assert 'does not answer' in why
    flight.boards.failing = False
    for card in list(flight.boards.cards.values()):
        card.close()
    flight.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    assert flight.stage.reset()[0]
    assert flight.stage.mode is Mode.FOLLOWING
    flight.stage.read()


def test_an_expired_watchdog_at_the_next_sample() -> None:
    flight = airborne()
    flight.boards.expire()
    assert not np.any(flight.boards.volts)
    with pytest.raises(StageError, match='watchdog expired'):
        flight.stage.read()
    assert flight.stage.fault is not None
    assert flight.stage.fault.kind == 'watchdog'
    for _ in range(1500):
        flight.boards.tick()
    assert not np.any(flight.boards.volts)
    flight.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    assert flight.stage.reset()[0]
    sample = flight.stage.read()
    assert sample.gap == pytest.approx([LOWER_STOP] * 4, abs=1e-9)


def test_a_late_tick_at_the_next_sample() -> None:
    flight = airborne()
    flight.boards.delay(3)
    flight.run(10)
    assert flight.stage.fault is None  # late, but within the bound
    assert flight.stage.late_ticks > 0
    assert since(flight, lambda: flight.boards.delay(8), 2) == 1
    assert 'late' in str(flight.stage.fault)
    landed(flight)


@pytest.mark.parametrize('late', [3, 8, 14])
def test_a_bridge_that_catches_up_knows_how_the_platen_moves(late: int) -> None:
    """The second board's encoders are read at once: they are ahead of the sample they come with."""
    flight = airborne(samples=400)
    flight.boards.delay(late)
    flight.run(late + 2)
    state = flight.stage.guard.arrays
    np.testing.assert_allclose(state.position, flight.rig.state[::2], atol=5e-5)
    np.testing.assert_allclose(state.rate[:3], flight.rig.state[1:6:2], atol=5e-3)
    assert (flight.stage.fault is None) == (late == 3)
    if late > 3:
        landed(flight)


def test_a_landing_goes_on_while_samples_come_late() -> None:
    """Every third one, within the bound: it must not begin anew with each."""
    flight = airborne()
    flight.stage.land('asked to')
    for k in range(2000):
        if k % 3 == 0:
            flight.boards.delay(1)
        flight.run(1, controlled=False)
    assert flight.stage.late_ticks > 500
    assert flight.stage.mode is Mode.DISABLED
    assert flight.rig.impact <= SOFT


@pytest.mark.parametrize('phase', range(12))
def test_a_dead_phase_near_the_magnets_is_found_and_landed(phase: int) -> None:
    """Before the tilt that it leaves uncontrolled has gone too far to be undone."""
    flight = airborne(hover(0.020))
    flight.boards.dead(phase)
    flight.run(1500)
    flight.stage.land('nothing was found')
    flight.until_no_current()
    assert flight.rig.impact <= 0.05
    if phase in (3, 9):  # that commutate i_d at x = 0
        assert 'do not explain' in str(flight.stage.fault)


def test_what_is_unexplained_for_ten_samples_is_a_fault_of_the_motors() -> None:
    flight = airborne(hover(0.020))
    flight.boards.dead(3)
    found = []
    while flight.stage.fault is None:
        flight.run(1)
        found.append(np.abs(flight.stage.guard.arrays.disturbance[3:]).max() > 10.0)
    assert 'of theta' in str(flight.stage.fault)
    assert flight.stage.fault.kind == 'current'
    assert found[-11:] == [False] + 10 * [True]


def test_a_bridge_that_stops_leaves_0_v_within_20_ms() -> None:
    flight = airborne()
    assert np.any(flight.boards.volts)
    for k in range(1, 31):
        flight.boards.tick()
        assert np.any(flight.boards.volts) == (k < 20)


@pytest.mark.parametrize('way', ['service', 'input'])
def test_emergency_stop(way: str) -> None:
    flight = airborne(**{'boards.stop_input': 0})

    def press() -> None:
        if way == 'service':
            flight.stage.stop()
        flight.boards.stop_pressed = way == 'input'

    assert since(flight, press, 1) <= 1
    assert flight.stage.mode is Mode.LANDING
    landed(flight)
    ok, why = flight.stage.reset()
    assert ok == (way == 'service')
    if not ok:
        assert 'pressed' in why
        flight.boards.stop_pressed = False
        flight.step(controlled=False)
        assert flight.stage.reset()[0]
    assert flight.stage.mode is Mode.FOLLOWING


def test_no_reset_while_it_lands() -> None:
    flight = airborne()
    flight.stage.stop()
    flight.step(controlled=False)
    assert flight.stage.reset() == (False, 'still landing: reset when the platen rests')


def test_one_encoder_less_does_not_end_a_landing() -> None:
    flight = airborne(hover(0.022), 150)
    flight.stage.stop()
    flight.run(50, controlled=False)
    flight.boards.jumps[0] += 100
    flight.run(2, controlled=False)
    assert flight.stage.mode is Mode.LANDING
    landed(flight)


@pytest.mark.parametrize('phase', [1, 9])
def test_a_dead_phase_ends_without_current(phase: int) -> None:
    flight = airborne()
    flight.boards.dead(phase)
    flight.run(3000)
    if flight.stage.fault is not None:
        flight.until_no_current()
        assert not np.any(flight.boards.volts)
    else:  # the regulator copes
        assert flight.stage.mode is Mode.FOLLOWING
