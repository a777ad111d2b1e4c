"""From dq currents to volts: commutation, limits, I²t."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_hw_bridge.amplifiers import (
    FINE,
    NOT_FINITE,
    OVER_CURRENT,
    OVER_LIMIT,
    SPENT,
    Amplifiers,
)
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build

TAU = 0.05715
OFFSET = (0.1, -0.2, 0.3, 1.0)
GAIN = tuple(0.5 + 0.1 * i for i in range(12))
SIGN = (1, -1) * 6
ZERO = tuple(0.01 * i for i in range(12))
WIRED = {
    'commutation.offset': OFFSET,
    'amplifier.gain': GAIN,
    'amplifier.sign': SIGN,
    'amplifier.offset': ZERO,
    'amplifier.voltage_range': 20.0,
}
CURRENT = st.floats(-4.0, 4.0)
FOUR = st.lists(CURRENT, min_size=4, max_size=4).map(np.array)
PLACE = st.floats(-0.05, 0.05)


def amplifiers(**overrides: object) -> Amplifiers:
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return Amplifiers(build(BridgeParameters, names))


@settings(max_examples=80)
@given(i_d=FOUR, i_q=FOUR, x=PLACE, z=PLACE)
def test_volts_to_currents_to_dq_and_back(
    i_d: np.ndarray, i_q: np.ndarray, x: float, z: float
) -> None:
    unit = Amplifiers(build(BridgeParameters, WIRED))
    code, _ = unit.drive(i_d, i_q, x, z)
    assert code == FINE
    current = (unit.volts - np.array(ZERO)) * np.array(GAIN) * np.array(SIGN)
    if np.max(np.abs(unit.arrays.wanted)) > 7.0:
        return
    for motor in range(4):
        phases = current[3 * motor : 3 * motor + 3]
        assert sum(phases) == pytest.approx(0.0, abs=1e-12)
        angle = math.pi * (z if motor in (0, 2) else x) / TAU + OFFSET[motor]
        turned = (
            2.0
            / 3.0
            * sum(phase * np.exp(2j * math.pi * k / 3.0) for k, phase in enumerate(phases))
        )
        back = turned * np.exp(-1j * angle)
        assert (back.real, back.imag) == pytest.approx((i_d[motor], i_q[motor]), abs=1e-12)


@settings(max_examples=60)
@given(commands=st.lists(st.tuples(FOUR, FOUR), min_size=1, max_size=6), x=PLACE, z=PLACE)
def test_nothing_leaves_its_limits(commands: list, x: float, z: float) -> None:
    slew = 2000.0
    unit = Amplifiers(build(BridgeParameters, {**WIRED, 'amplifier.slew': slew}))
    unit.arrays.voltage_range = 3.0  # which parameters refuse: less than the peak
    last = np.zeros(12)
    for i_d, i_q in commands:
        unit.drive(2.0 * i_d, 1.5 * i_q, x, z)
        assert np.all(np.abs(unit.volts) <= 3.0)
        assert np.all(np.abs(unit.arrays.current) <= 7.0)
        assert np.all(np.abs(unit.arrays.current - last) <= slew * 1e-3 + 1e-12)
        said = np.array(ZERO) + np.array(SIGN) / np.array(GAIN) * unit.arrays.current
        np.testing.assert_allclose(unit.volts, said, atol=1e-12)
        last = unit.arrays.current.copy()


def test_the_peak_of_a_phase() -> None:
    unit = amplifiers()
    assert unit.drive(np.full(4, 9.0), np.zeros(4), 0.0, 0.0)[0] == FINE
    assert unit.volts[::3] == pytest.approx([7.0] * 4)
    assert unit.volts[1::3] == pytest.approx([-4.5] * 4)


@pytest.mark.parametrize(
    ('value', 'code'), [(math.nan, NOT_FINITE), (math.inf, NOT_FINITE), (11.0, OVER_LIMIT)]
)
def test_a_bad_command_changes_nothing(value: float, code: int) -> None:
    unit = amplifiers()
    unit.drive(np.ones(4), np.ones(4), 0.01, 0.02)
    before = unit.volts.copy()
    bad = np.ones(4)
    bad[3] = value
    assert unit.drive(bad, np.ones(4), 0.0, 0.0) == (code, 3)
    assert unit.drive(np.ones(4), bad, 0.0, 0.0) == (code, 3)
    assert unit.volts.tolist() == before.tolist()


def test_a_phase_current_that_must_not_be_asked_for() -> None:
    unit = amplifiers(fault__over_current=8.9)
    code, phase = unit.drive(np.array([0.0, 0.0, 9.0, 0.0]), np.zeros(4), 0.0, 0.0)
    assert (code, phase) == (OVER_CURRENT, 6)


@pytest.mark.parametrize('current', [2.0, 4.0, 5.5])
def test_the_load_follows_the_square_of_the_current(current: float) -> None:
    unit = amplifiers(amplifier__thermal_time=2.0)
    i_d, zero = np.full(4, current), np.zeros(4)
    for _ in range(1000):
        unit.drive(i_d, zero, 0.0, 0.0)
    expected = (current / 5.0) ** 2 * (1.0 - math.exp(-1.0 / 2.0))
    assert unit.load == pytest.approx(expected, rel=1e-9)
    for _ in range(1000):
        unit.drive(zero, zero, 0.0, 0.0)
    assert unit.load == pytest.approx(expected * math.exp(-1.0 / 2.0), rel=1e-9)


@pytest.mark.parametrize('phase', [0, 11])
def test_outputs_that_cannot_ask_for_the_peak_are_refused(phase: int) -> None:
    gain, offset = [1.0] * 12, [0.0] * 12
    offset[phase] = -0.5
    gain[phase] = 7.0 / 9.5 + 1e-9
    amplifiers(amplifier__gain=gain, amplifier__offset=offset)
    gain[phase] -= 1e-6
    with pytest.raises(ParameterError, match=rf'amplifier\.gain\[{phase}\].*peak_current'):
        amplifiers(amplifier__gain=gain, amplifier__offset=offset)


def test_cut_makes_no_current_at_once() -> None:
    unit = Amplifiers(build(BridgeParameters, {**WIRED, 'amplifier.slew': 1000.0}))
    for _ in range(5):
        unit.drive(np.full(4, 3.0), np.zeros(4), 0.0, 0.0)
    assert np.any(unit.arrays.current)
    assert unit.cut().tolist() == list(ZERO)
    assert not np.any(unit.arrays.current)
    unit.drive(np.zeros(4), np.zeros(4), 0.0, 0.0)  # and there is no slope left to go down
    assert unit.volts.tolist() == list(ZERO)


def test_what_comes_of_a_command_is_told_apart() -> None:
    assert len({FINE, NOT_FINITE, OVER_LIMIT, OVER_CURRENT, SPENT}) == 5


@pytest.mark.parametrize(('way', 'limit'), [(0.0, 7.0), (0.25, 6.5), (1.0, 5.0), (1.3, 5.0)])
def test_a_phase_that_is_hot_carries_less(way: float, limit: float) -> None:
    """From its peak at the load where that begins to shrink down to what it may carry for ever."""
    loads = {'amplifier.derate_load': 0.8, 'amplifier.trip_load': 1.0}  # halfway is all done
    currents = {'amplifier.continuous_current': 5.0, 'amplifier.peak_current': 7.0}
    unit = Amplifiers(build(BridgeParameters, {**loads, **currents}))
    unit.arrays.load[:] = 0.8 + way * 0.1
    assert unit.drive_phases(np.tile([9.0, -9.0], 6)) == pytest.approx(np.tile([limit, -limit], 6))


@pytest.mark.parametrize('phase', [0, 5, 11])
def test_one_phase_is_enough_to_be_spent(phase: int) -> None:
    unit, zero = amplifiers(), np.zeros(4)
    unit.arrays.load[:] = 0.25
    unit.arrays.load[phase] = 0.5
    unit.arrays.heating = 0.0  # so that it is what it is
    unit.arrays.trip = 0.5
    assert unit.drive(zero, zero, 0.0, 0.0) == (SPENT, phase)
    unit.arrays.trip = np.nextafter(0.5, 1.0)
    assert unit.drive(zero, zero, 0.0, 0.0) == (FINE, 0)


def test_what_is_just_allowed_is_put_out() -> None:
    unit = amplifiers()
    unit.arrays.command_limit = 5.0
    assert unit.drive(np.full(4, 3.0), np.full(4, -4.0), 0.0, 0.0) == (FINE, 0)
    largest = np.abs(unit.arrays.wanted).max()
    unit.arrays.trip_current = largest
    assert unit.drive(np.full(4, 3.0), np.full(4, -4.0), 0.0, 0.0) == (FINE, 0)
    unit.arrays.trip_current = np.nextafter(largest, 0.0)
    assert unit.drive(np.full(4, 3.0), np.full(4, -4.0), 0.0, 0.0)[0] == OVER_CURRENT


def test_it_is_warm_from_where_it_shall_warn() -> None:
    unit = amplifiers(amplifier__warn_load=0.5)
    unit.arrays.load[7] = 0.5
    assert unit.warm
    unit.arrays.load[7] = 0.49
    assert not unit.warm
