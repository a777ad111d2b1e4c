"""Motor forces (1)-(4) against known figures and the identities of superposed fields."""

from __future__ import annotations

import math

import numpy as np
import paper_motor as paper
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model import motor
from maglev_model.machine import Machine, MachineParameters, machine_constants
from maglev_model.machine_array import machine_from_array, machine_to_array
from maglev_model.parameters import ParameterError, build

MACHINE = machine_constants(MachineParameters())
GAPS = st.floats(0.017, 0.034)
CURRENTS = st.floats(-10.0, 10.0)


@given(gap=GAPS, i_d=CURRENTS, i_q=CURRENTS)
def test_constants_of_rms_values_take_amplitudes_all_the_same(
    gap: float, i_d: float, i_q: float
) -> None:
    rms = machine_constants(MachineParameters(dq_scaling='rms'))
    root = math.sqrt(2.0)
    found = motor.forces_of_currents(motor.force_coefficients(rms, gap), root * i_d, root * i_q)
    expected = motor.forces_of_currents(motor.force_coefficients(MACHINE, gap), i_d, i_q)
    assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ('gap', 'attraction', 'direct', 'horizontal', 'quadratic'),
    [
        (0.018, 241.5, 43.4, 37.0, 7.8),
        (0.020, 188.3, 37.5, 33.0, 7.5),
        (0.025, 103.7, 26.9, 25.0, 7.0),
        (0.030, 58.4, 19.8, 19.0, 6.7),
        (0.031, 52.1, 18.7, 18.0, 6.7),
    ],
)
def test_known_forces(
    gap: float, attraction: float, direct: float, horizontal: float, quadratic: float
) -> None:
    k_1, k_2, k_3, k_h = motor.force_coefficients(MACHINE, gap)
    assert 4.0 * k_1 == pytest.approx(attraction, abs=0.05)
    assert k_2 == pytest.approx(direct, abs=0.05)
    assert k_h == pytest.approx(horizontal, abs=0.05)
    assert k_3 == pytest.approx(quadratic, abs=0.05)


def test_unforced_balance_and_its_unstable_poles() -> None:
    def net(gap: float) -> float:
        return MACHINE.G + 4.0 * paper.vertical_force(MACHINE, gap, 0.0, 0.0) / MACHINE.M_y

    low, high = 0.020, 0.031
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if net(middle) < 0.0 else (low, middle)
    assert low == pytest.approx(0.0287, abs=5e-5)
    slope = (net(0.025 + 1e-6) - net(0.025 - 1e-6)) / 2e-6
    assert math.sqrt(slope) == pytest.approx(42.0, abs=0.3)


@settings(max_examples=50)
@given(
    turns=st.integers(100, 3000),
    charge=st.floats(5e5, 1.5e6),
    pitch=st.floats(0.035, 0.2),
    pairs=st.integers(1, 9),
    gap=GAPS,
)
def test_fields_superpose_for_any_machine(
    turns: int, charge: float, pitch: float, pairs: int, gap: float
) -> None:
    machine = machine_constants(
        MachineParameters(turns=turns, magnet_charge=charge, pole_pitch=pitch, pole_pairs=pairs)
    )
    assert machine.K_v2**2 == pytest.approx(4.0 * machine.K_v1 * machine.K_v3, rel=1e-12)
    _, _, _, k_h = motor.force_coefficients(machine, gap)
    field = paper.slot_permeance(machine, gap) * paper.magnet_field(machine, gap)
    expected = machine.K_v2 * field / paper.carter_coefficient(machine, gap)
    assert k_h == pytest.approx(expected, rel=1e-12)


@settings(max_examples=100)
@given(gap=GAPS, i_d=CURRENTS, i_q=CURRENTS)
def test_vertical_force_is_minus_a_square_and_the_quadrature_part(
    gap: float, i_d: float, i_q: float
) -> None:
    a, b, k_h = motor.attraction_coefficients(MACHINE, gap)
    expected = -((a - b * i_d) ** 2) - (b * i_q) ** 2
    assert paper.vertical_force(MACHINE, gap, i_d, i_q) == pytest.approx(
        expected, rel=1e-11, abs=1e-9
    )
    assert paper.horizontal_force(MACHINE, gap, i_q) == pytest.approx(-k_h * i_q, rel=1e-12)


@settings(max_examples=50)
@given(gap=GAPS)
def test_combined_functions_are_the_single_ones(gap: float) -> None:
    factors = MACHINE.K_v1, MACHINE.K_v2, MACHINE.K_v3, MACHINE.K_h
    single = [f(MACHINE, gap) for f in (paper.L_v1, paper.L_v2, paper.L_v3, paper.L_h)]
    wanted = np.multiply(factors, single)
    assert motor.force_coefficients(MACHINE, gap) == pytest.approx(wanted, rel=1e-12)


def test_factors_written_out_at_25_mm() -> None:
    """Every factor of (4) computed by hand from Table I."""
    g, b_0, t_1, tau, h_m = 0.025, 0.0127, 0.01905, 0.05715, 0.005
    half = b_0 / (2 * g)
    gamma = 4 / np.pi * (half * np.arctan(half) - np.log(np.sqrt(1 + half**2)))
    assert paper.slot_factor(MACHINE, g) == pytest.approx(gamma, rel=1e-12)
    assert paper.carter_coefficient(MACHINE, g) == pytest.approx(t_1 / (t_1 - g * gamma), rel=1e-12)
    permeance = 1 - b_0**2 / (4 * t_1 * (g + b_0 / 2 + h_m / 1.05))
    assert paper.slot_permeance(MACHINE, g) == pytest.approx(permeance, rel=1e-12)
    field = 4 / np.pi * 4e-7 * np.pi * 875400 * np.sinh(np.pi * h_m / tau)
    field *= np.sin(np.pi * 0.02858 / (2 * tau)) / np.sinh(np.pi / tau * (h_m + g))
    assert paper.magnet_field(MACHINE, g) == pytest.approx(field, rel=1e-12)


def test_machine_survives_the_array() -> None:
    array = machine_to_array(MACHINE)
    assert array.shape == (len(Machine._fields),)
    assert machine_from_array(array) == MACHINE


@pytest.mark.parametrize(
    ('name', 'value'),
    [
        ('gap_min', 18.0),
        ('slot_width', 12.7),
        ('mass_y', 6900.0),
        ('turns', 900.0),
        ('turns', 36_000),
        ('G', 9.81),
    ],
)
def test_wrong_units_types_and_names_are_refused(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name):
        build(MachineParameters, {name: value})


def test_range_upside_down_is_refused() -> None:
    with pytest.raises(ParameterError, match=r'gap_min.*gap_max'):
        build(MachineParameters, {'gap_min': 0.032})


def test_without_slots_both_forces_have_one_coenergy_and_with_them_nearly() -> None:
    """Of flux in a winding: by the gap it is as (2) has it, by the displacement as (1)."""

    def share(machine: Machine, gap: float) -> float:
        step = 1e-6
        k_h = [motor.force_coefficients(machine, gap + side * step)[3] for side in (-1.0, 1.0)]
        by_thrust = -machine.tau / math.pi * (k_h[1] - k_h[0]) / (2.0 * step)
        return by_thrust / motor.force_coefficients(machine, gap)[1]

    for gap in (0.018, 0.025, 0.03):
        assert share(MACHINE._replace(b_0=1e-9), gap) == pytest.approx(1.0, abs=1e-6)
    assert share(MACHINE, 0.018) == pytest.approx(0.893, abs=1e-3)
    assert share(MACHINE, 0.03) == pytest.approx(0.950, abs=1e-3)
