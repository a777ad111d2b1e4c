"""A platen whose air gap no encoder shows any more: pushed down, and held there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from maglev_hw_bridge.landing import (
    Landing,
    impact_of_push,
    impacts_of_cut,
    push_is_softer,
)
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.machine import machine_constants
from maglev_model.platen import output_accelerations

PARAMETERS = BridgeParameters()
MACHINE = machine_constants(PARAMETERS.machine)
T = PARAMETERS.sample_time
GAP_MIN, GAP_MAX = PARAMETERS.machine.gap_min, PARAMETERS.machine.gap_max
UNSEEN = np.array([True, False, False, True, True])

gaps = st.floats(GAP_MIN, GAP_MAX)
speeds = st.floats(-0.3, 0.3)


def at(y: float) -> np.ndarray:
    return np.array([y, 0.0, 0.0, 0.0, 0.0])


def pushing(y: float = 0.025) -> Landing:
    landing = Landing(PARAMETERS)
    landing.begin(at(y), np.zeros(5), UNSEEN)
    return landing


def downward(landing: Landing, y: float) -> float:
    """What its currents do to a platen that is truly there [m/s²]."""
    acceleration, *_ = output_accelerations(
        MACHINE, y, 0.0, 0.0, landing.direct_current, landing.quadrature_current
    )
    return float(acceleration)


@given(believed=gaps, speed=speeds)
def test_what_has_arrived_is_never_lifted(believed: float, speed: float) -> None:
    landing = pushing()
    for _ in range(2):
        landing.step(at(believed), at(speed), np.zeros(5))
        assert downward(landing, GAP_MAX) > 1.0


@pytest.mark.parametrize('y', [0.0185, 0.022, 0.026, 0.0299])
def test_it_is_pushed_as_hard_anywhere(y: float) -> None:
    landing = pushing()
    landing.step(at(y), at(0.1), np.zeros(5))
    assert downward(landing, y) == pytest.approx(4.0)


@pytest.mark.parametrize(('y', 'speed'), [(0.0299, 0.1), (0.0301, -1e-3)])
def test_it_is_held_once_the_model_has_it_down(y: float, speed: float) -> None:
    landing = pushing()
    landing.step(at(y), at(speed), np.zeros(5))
    assert landing.arrays.held == 0.0
    landing.step(at(0.0301), at(0.0), np.zeros(5))
    currents = landing.direct_current.copy()
    assert downward(landing, landing.arrays.balance) == pytest.approx(2.0)
    landing.step(at(0.0250), at(-0.1), np.zeros(5))  # whatever it has afterwards
    np.testing.assert_array_equal(landing.direct_current, currents)


def test_as_it_has_no_way_it_cannot_leave_it() -> None:
    landing = pushing(0.020)
    for _ in range(3):
        landing.step(at(0.028), at(0.3), np.zeros(5))
        assert not landing.astray


@pytest.mark.parametrize(('y', 'over'), [(0.0305, 0.15), (0.025, 0.5)])
def test_it_is_over_when_it_was_held_or_after_half_a_second(y: float, over: float) -> None:
    landing = pushing()
    steps = 1
    while not landing.step(at(y), np.zeros(5), np.zeros(5)):
        steps += 1
    assert steps * T == pytest.approx(over, abs=2.0 * T)


@pytest.mark.parametrize('y', [0.0185, 0.022, 0.025, 0.028])
@pytest.mark.parametrize('speed', [-0.05, 0.0, 0.05])
def test_it_strikes_as_foretold_where_the_model_is_right(y: float, speed: float) -> None:
    landing = pushing(y)

    def motion(_time: float, state: np.ndarray) -> list[float]:
        landing.step(at(state[0]), at(state[1]), np.zeros(5))
        return [state[1], downward(landing, state[0])]

    def stop(_time: float, state: np.ndarray) -> float:
        return float(state[0] - (GAP_MAX - 1e-3))  # held from there on

    stop.terminal = True  # type: ignore[attr-defined]
    flown = solve_ivp(motion, (0.0, 0.4), [y, speed], events=stop, max_step=1e-3)
    last = math.sqrt(flown.y[1, -1] ** 2 + 2.0 * 4.0 * 1e-3)
    assert impact_of_push(PARAMETERS, y, speed) == pytest.approx(last, rel=0.02)


def test_of_what_is_nowhere_the_most_is_foretold() -> None:
    most = impact_of_push(PARAMETERS, GAP_MIN, 0.0)
    assert impact_of_push(PARAMETERS, math.nan, math.nan) == most
    assert impact_of_push(PARAMETERS, 0.01, 0.0) == most
    assert impact_of_push(PARAMETERS, GAP_MAX + 1e-3, 0.02) == 0.02


@given(y=gaps, speed=speeds)
def test_what_may_strike_no_harder_by_a_cut_is_cut(y: float, speed: float) -> None:
    push = impact_of_push(PARAMETERS, y, speed)
    cut = max(impacts_of_cut(PARAMETERS, y, speed).values())
    assert push_is_softer(PARAMETERS, y, speed) == (push < cut)


def test_near_either_stop_nothing_is_pushed() -> None:
    pushed = [y for y in np.arange(0.0181, 0.031, 1e-4) if push_is_softer(PARAMETERS, y, 0.0)]
    assert 0.019 < pushed[0] < 0.021
    assert 0.0285 < pushed[-1] < 0.0302
