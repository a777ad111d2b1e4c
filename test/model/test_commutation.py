"""Park's transformation."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.commutation import (
    direct_quadrature_currents,
    electrical_angle,
    phase_currents,
)
from maglev_model.machine import MachineParameters, machine_constants

CURRENT = st.floats(-10.0, 10.0)
ANGLE = st.floats(-20.0, 20.0)


@settings(max_examples=100)
@given(i_d=CURRENT, i_q=CURRENT, angle=ANGLE)
def test_there_and_back(i_d: float, i_q: float, angle: float) -> None:
    phases = phase_currents(i_d, i_q, angle)
    assert sum(phases) == pytest.approx(0.0, abs=1e-12)
    back = direct_quadrature_currents(*phases, angle)
    assert back == pytest.approx((i_d, i_q), abs=1e-12)


@settings(max_examples=50)
@given(i_d=CURRENT, i_q=CURRENT, angle=ANGLE)
def test_phases_are_the_projections_on_three_windings(i_d: float, i_q: float, angle: float) -> None:
    for phase, current in enumerate(phase_currents(i_d, i_q, angle)):
        winding = 2.0 * math.pi * phase / 3.0
        expected = i_d * math.cos(angle - winding) - i_q * math.sin(angle - winding)
        assert current == pytest.approx(expected, abs=1e-12)


def test_the_amplitude_of_a_phase_is_the_length_of_the_vector() -> None:
    assert phase_currents(7.0, 0.0, 0.0)[0] == 7.0


def test_a_common_current_makes_no_field() -> None:
    assert direct_quadrature_currents(2.0, 2.0, 2.0, 0.7) == pytest.approx((0.0, 0.0))


def test_one_pole_pitch_is_half_a_turn() -> None:
    machine = machine_constants(MachineParameters())
    assert electrical_angle(machine, 0.05715) == pytest.approx(math.pi)
