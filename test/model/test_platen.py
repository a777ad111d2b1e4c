"""Geometry (5), dynamics (6), (7) and affine terms (9)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from paper_motor import L_h, L_v1, L_v2, L_v3, horizontal_force, vertical_force

from maglev_model.geometry import motor_gaps, outputs_of_gaps
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.platen import (
    affine_terms,
    gaps_from_outputs,
    output_accelerations,
    outputs_from_gaps,
)

M = machine_constants(MachineParameters())
OUTPUTS = st.tuples(
    st.floats(0.018, 0.031),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.003, 0.003),
    st.floats(-0.014, 0.014),
)
CURRENT = st.floats(-7.0, 7.0)


def _gaps(y: float, phi: float, theta: float) -> NDArray[np.float64]:
    lift, roll = M.r * math.sin(phi), M.r * math.sin(theta)
    return np.array([y - lift, y + roll, y + lift, y - roll])


def _by_the_paper(
    y: float, phi: float, theta: float, u_y: list[float], u_x: float, u_z: float
) -> list[float]:
    """(6), (7) as printed, term by term."""
    g1, g2, g3, g4 = _gaps(y, phi, theta)
    u1, u2, u3, u4 = u_y
    k1 = [M.K_v1 / M.M_y * L_v1(M, g) for g in (g1, g2, g3, g4)]
    k2 = [M.K_v2 / M.M_y * L_v2(M, g) for g in (g1, g2, g3, g4)]
    k3 = [M.K_v3 / M.M_y * L_v3(M, g) for g in (g1, g2, g3, g4)]
    y_dd = M.G - k1[2] - k1[0] - k1[1] - k1[3]
    y_dd += k2[2] * u3 + k2[0] * u1 + k2[1] * u2 + k2[3] * u4
    y_dd -= (k3[2] + k3[0]) * u_z**2 + k3[2] * u3**2 + k3[0] * u1**2
    y_dd -= (k3[1] + k3[3]) * u_x**2 + k3[1] * u2**2 + k3[3] * u4**2
    phi_dd = -k1[2] + k2[2] * u3 - k3[2] * u3**2 + k1[0] - k2[0] * u1 + k3[0] * u1**2
    phi_dd = M.k_rot * (phi_dd - (k3[2] - k3[0]) * u_z**2) - M.k_s_phi * phi
    theta_dd = -k1[1] + k2[1] * u2 - k3[1] * u2**2 + k1[3] - k2[3] * u4 + k3[3] * u4**2
    theta_dd = M.k_rot * (theta_dd - (k3[1] - k3[3]) * u_x**2) - M.k_s_theta * theta
    x_dd = -M.K_h / M.M_x * (L_h(M, g2) + L_h(M, g4)) * u_x
    z_dd = -M.K_h / M.M_z * (L_h(M, g3) + L_h(M, g1)) * u_z
    return [y_dd, x_dd, z_dd, phi_dd, theta_dd]


def _accelerations(output: tuple[float, ...], i_d: list[float], i_q: list[float]) -> list[float]:
    y, _, _, phi, theta = output
    return list(output_accelerations(M, y, phi, theta, np.array(i_d), np.array(i_q)))


@settings(max_examples=100)
@given(output=OUTPUTS, u_y=st.lists(CURRENT, min_size=4, max_size=4), u_x=CURRENT, u_z=CURRENT)
def test_dynamics_are_the_printed_ones(
    output: tuple[float, ...], u_y: list[float], u_x: float, u_z: float
) -> None:
    expected = _by_the_paper(output[0], output[3], output[4], u_y, u_x, u_z)
    got = _accelerations(output, u_y, [u_z, u_x, u_z, u_x])
    assert got == pytest.approx(expected, rel=1e-10, abs=1e-9)


@settings(max_examples=100)
@given(
    output=OUTPUTS,
    v=st.tuples(*[st.floats(-14.0, 14.0)] * 3),
    u_x=CURRENT,
    u_z=CURRENT,
)
def test_affine_form_is_the_full_model(
    output: tuple[float, ...], v: tuple[float, float, float], u_x: float, u_z: float
) -> None:
    v_y, v_phi, v_theta = v
    a, b, c = np.empty(9), np.empty(6), np.empty(6)
    affine_terms(M, output[0], output[3], output[4], u_x, u_z, a, b, c)
    terms_a = [1, v_phi, v_y, v_phi * v_y, v_phi**2, v_y**2, v_theta, v_y * v_theta, v_theta**2]
    terms_b = [1, v_phi, v_y, v_phi * v_y, v_phi**2, v_y**2]
    terms_c = [1, v_theta, v_y, v_y * v_theta, v_theta**2, v_y**2]
    u_y = [(v_y + v_phi) / 2, (v_y - v_theta) / 2, (v_y - v_phi) / 2, (v_y + v_theta) / 2]  # (8)
    full = _accelerations(output, u_y, [u_z, u_x, u_z, u_x])
    assert float(a @ terms_a) == pytest.approx(full[0], rel=1e-9, abs=1e-8)
    assert float(b @ terms_b) == pytest.approx(full[3], rel=1e-9, abs=1e-7)
    assert float(c @ terms_c) == pytest.approx(full[4], rel=1e-9, abs=1e-7)


@settings(max_examples=50)
@given(
    output=OUTPUTS,
    i_d=st.lists(CURRENT, min_size=4, max_size=4),
    i_q=st.lists(CURRENT, min_size=4, max_size=4),
)
def test_eight_independent_currents_act_where_their_motors_are(
    output: tuple[float, ...], i_d: list[float], i_q: list[float]
) -> None:
    gaps = _gaps(output[0], output[3], output[4])
    down = [vertical_force(M, g, d, q) for g, d, q in zip(gaps, i_d, i_q, strict=True)]
    along = [horizontal_force(M, g, q) for g, q in zip(gaps, i_q, strict=True)]
    expected = [
        M.G + sum(down) / M.M_y,
        (along[1] + along[3]) / M.M_x,
        (along[0] + along[2]) / M.M_z,
        M.r * (down[2] - down[0]) / M.I_x - M.k_s_phi * output[3],
        M.r * (down[1] - down[3]) / M.I_x - M.k_s_theta * output[4],
    ]
    assert _accelerations(output, i_d, i_q) == pytest.approx(expected, rel=1e-10, abs=1e-9)


@settings(max_examples=100)
@given(output=OUTPUTS)
def test_geometry_goes_there_and_back(output: tuple[float, ...]) -> None:
    gap, back = np.empty(4), np.empty(5)
    gaps_from_outputs(M, np.array(output), gap)
    assert gap == pytest.approx(_gaps(output[0], output[3], output[4]), abs=1e-15)
    residual = outputs_from_gaps(M, gap, output[1], output[2], back)
    assert back == pytest.approx(np.array(output), abs=1e-15)
    assert abs(residual) < 1e-16


def test_gaps_that_contradict_each_other() -> None:
    back = np.empty(5)
    residual = outputs_from_gaps(M, np.array([0.025, 0.025, 0.025, 0.0251]), 0.0, 0.0, back)
    assert residual == pytest.approx(-1e-4, abs=1e-12)
    assert back[0] == pytest.approx(0.025025)
    outputs_from_gaps(M, np.array([0.0, 0.025, 1.0, 0.025]), 0.0, 0.0, back)
    assert math.isnan(back[3])
    assert back[4] == 0.0


@settings(max_examples=50)
@given(output=OUTPUTS)
def test_the_geometry_of_arrays_is_the_same(output: tuple[float, ...]) -> None:
    position = np.array([output, output])
    gap = motor_gaps(position, M.r)
    assert gap[1] == pytest.approx(_gaps(output[0], output[3], output[4]), abs=1e-15)
    back = outputs_of_gaps(gap, position[:, 1], position[:, 2], M.r)
    assert back == pytest.approx(position, abs=1e-14)


@pytest.mark.parametrize('gap', [[0.03, np.nan, 0.03, 0.03], [0.0, 0.5, 1.0, 0.5]])
def test_readings_no_platen_gives_have_no_tilt(gap: list[float]) -> None:
    assert not np.isfinite(outputs_of_gaps(np.array(gap), 0.0, 0.0, M.r)[3:]).all()
