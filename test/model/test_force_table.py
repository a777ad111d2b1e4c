"""The table of a motor's forces against the formulas that it is made of."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.force_table import ROWS, TOLERANCE, force_table, tabulated_coefficients
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.motor import force_coefficients

P = MachineParameters()
M = machine_constants(P)
TABLE = force_table(P, M)
(RECORD,) = TABLE.block
LAST = TABLE.first + ROWS / TABLE.per_metre


def test_it_reaches_over_all_gaps_that_the_stops_leave() -> None:
    tilt = P.radius * P.theta_max
    assert P.gap_min - tilt == TABLE.first
    assert math.isclose(LAST, P.gap_max + tilt, rel_tol=1e-12)


@given(st.floats(TABLE.first, LAST - 1e-9))
def test_it_agrees_with_the_formulas(gap: float) -> None:
    found = tabulated_coefficients(RECORD, M, gap)
    np.testing.assert_allclose(found, force_coefficients(M, gap), rtol=TOLERANCE)


def test_it_is_not_the_formulas_themselves() -> None:
    gaps = np.linspace(TABLE.first, LAST - 1e-9, 1000)
    found = np.array([tabulated_coefficients(RECORD, M, gap) for gap in gaps])
    assert np.any(found != np.array([force_coefficients(M, gap) for gap in gaps]))


def test_it_is_of_the_constants_it_is_given_with_their_offsets() -> None:
    off = M._replace(K_v2=1.1 * M.K_v2, K_h=0.9 * M.K_h)
    (record,) = force_table(P, off).block
    found = tabulated_coefficients(record, off, 0.0231)
    np.testing.assert_allclose(found, force_coefficients(off, 0.0231), rtol=TOLERANCE)


@given(
    st.floats(5e-3, 0.1),
    st.floats(2e-3, 0.03),
    st.floats(1e-3, 0.03),
    st.floats(0.01, 0.9),
    st.floats(0.05, 1.0),
    st.floats(-0.05, 1.05),
)
def test_any_machine_has_its_own_forces(
    pitch: float, least: float, range_: float, slot: float, radius: float, place: float
) -> None:
    """Also where the table would not be good enough, and beyond it: the formulas serve there."""
    parameters = dataclasses.replace(
        P,
        pole_pitch=pitch,
        magnet_width=0.5 * pitch,
        slot_pitch=0.1,
        slot_width=max(0.1 * slot, 1e-3),
        gap_min=least,
        gap_max=least + range_,
        radius=radius,
        theta_max=min(P.theta_max, 0.9 * least / radius),
        phi_max=min(P.phi_max, 0.9 * least / radius),
    )
    machine = machine_constants(parameters)
    table = force_table(parameters, machine)
    tilt = radius * max(parameters.theta_max, parameters.phi_max)
    gap = least - tilt + place * (range_ + 2.0 * tilt)
    found = tabulated_coefficients(table.block[0], machine, max(gap, 1e-4))
    exact = force_coefficients(machine, max(gap, 1e-4))
    np.testing.assert_allclose(found, exact, rtol=2.0 * TOLERANCE)
    if not math.isfinite(table.first) or not -1e-9 < place < 1.0 + 1e-9:
        assert found == exact


def test_a_table_that_cannot_be_good_enough_is_not_used() -> None:
    """Of a range that is too wide, and of one in which motors could come through the stator."""
    wide = dataclasses.replace(P, gap_min=1e-3, gap_max=0.2, theta_max=1e-5, phi_max=1e-5)
    through = dataclasses.replace(P, gap_min=1e-3)
    for parameters in (wide, through):
        machine = machine_constants(parameters)
        table = force_table(parameters, machine)
        assert not math.isfinite(table.first)
        (record,) = table.block
        assert tabulated_coefficients(record, machine, 2e-3) == force_coefficients(machine, 2e-3)


def test_what_is_no_gap_has_no_force() -> None:
    assert all(math.isnan(one) for one in tabulated_coefficients(RECORD, M, math.nan))
