"""The terms of (9) over the operating range: (10), Fig. 3, and what (11) may drop."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from paper_motor import vertical_force

from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.platen import output_accelerations
from maglev_study import terms_cli
from maglev_study.terms import (
    TiltRange,
    condition_range,
    contributions,
    direct_currents,
    dropped,
    holding,
    holding_inputs,
    hover_current,
    input_matrix,
    largest_terms,
    negligible_up_to,
    terms,
)

M = machine_constants(MachineParameters())
TILTS = TiltRange(phi=0.003, theta=0.014, steps=2)
GAP, PHI, THETA = st.floats(0.020, 0.030), st.floats(-0.003, 0.003), st.floats(-0.014, 0.014)
INPUT = st.floats(-4.0, 4.0)


def _full_model(y: float, phi: float, theta: float, i_d: np.ndarray) -> np.ndarray:
    """Accelerations of y, phi, theta by (6), (7)."""
    found = output_accelerations(M, y, phi, theta, i_d, np.zeros(4))
    return np.array(found)[[0, 3, 4]]


@settings(max_examples=25)
@given(GAP, PHI, THETA, INPUT, INPUT, INPUT)
def test_contributions_add_up_to_the_full_model(
    y: float, phi: float, theta: float, v_y: float, v_phi: float, v_theta: float
) -> None:
    v = np.array([v_y, v_phi, v_theta])
    parts = contributions(terms(M, y, phi, theta), v)
    expected = _full_model(y, phi, theta, direct_currents(v))
    assert [parts[name].sum() for name in 'abc'] == pytest.approx(list(expected), abs=1e-9)


@settings(max_examples=25)
@given(GAP, PHI, THETA)
def test_holding_inputs_hold_the_full_model(y: float, phi: float, theta: float) -> None:
    currents = direct_currents(holding_inputs(M, y, phi, theta))
    assert _full_model(y, phi, theta, currents) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@given(GAP)
@settings(max_examples=20)
def test_hover_current_carries_the_weight(gap: float) -> None:
    current = hover_current(M, gap)
    assert 4.0 * vertical_force(M, gap, current, 0.0) == pytest.approx(-M.M_y * M.G, rel=1e-9)
    assert direct_currents(holding_inputs(M, gap, 0.0, 0.0)) == pytest.approx(current, abs=1e-9)


def test_where_the_platen_cannot_be_carried_is_said() -> None:
    weak = M._replace(K_v2=0.1 * M.K_v2)
    with pytest.raises(ValueError, match='no direct current'):
        hover_current(weak, 0.02)
    with pytest.raises(ValueError, match=r'cannot be held at y = 0\.02 m'):
        holding_inputs(weak, 0.02, 0.0, 0.0)


@settings(max_examples=15)
@given(GAP, PHI, THETA)
def test_no_tilt_has_larger_terms_than_the_largest(y: float, phi: float, theta: float) -> None:
    largest, found = largest_terms(M, [y], TiltRange()), terms(M, y, phi, theta)
    for name in 'abc':
        # b_1 and c_1 may peak between two points of the grid, and little above them.
        assert (np.abs(found[name]) <= 1.01 * largest[name][0] + 0.01).all()


def test_largest_terms_of_the_level_platen_follow_from_the_force_coefficients() -> None:
    found = largest_terms(M, [0.025], TiltRange(phi=0.0, theta=0.0, steps=1))
    per_ampere = (vertical_force(M, 0.025, 1.0, 0.0) - vertical_force(M, 0.025, -1.0, 0.0)) / 2.0
    square = -(vertical_force(M, 0.025, 0.0, 1.0) - vertical_force(M, 0.025, 0.0, 0.0))
    assert found.a[0, [1, 3, 6, 7]] == pytest.approx(0.0)
    assert found.a[0, 2] == pytest.approx(2.0 * per_ampere / M.M_y)
    assert found.a[0, [4, 5, 8]] == pytest.approx(np.array([0.5, 1.0, 0.5]) * square / M.M_y)
    assert found.b[0, 1] == pytest.approx(M.r / M.I_x * per_ampere)
    assert found.c[0, 3] == pytest.approx(M.r / M.I_x * square)


def test_what_is_dropped_is_a_fifth_at_20_mm_and_a_tenth_at_25_mm() -> None:
    level = TiltRange(phi=0.0, theta=0.0, steps=1)
    for gap, share in ((0.020, 0.20), (0.025, 0.10)):
        held = holding(M, gap, level)
        assert held.dropped[0] / held.linear[0] == pytest.approx(share, abs=0.005)


def test_negligible_up_to_is_the_current_at_which_the_share_is_reached() -> None:
    largest = largest_terms(M, [0.02, 0.03], TILTS)
    limits = negligible_up_to(largest, 0.05)
    for name, index in dropped():
        linear = {'a': largest.a[:, 2], 'b': largest.b[:, 1], 'c': largest.c[:, 1]}[name]
        v = 2.0 * limits[name][:, index]
        assert largest[name][:, index] * v**2 == pytest.approx(0.05 * linear * v)
    assert np.isnan(limits.a[:, :3]).all()
    names = ' '.join(f'{name}_{index + 1}' for name, index in dropped())
    assert names == 'a_4 a_5 a_6 a_8 a_9 b_4 b_5 b_6 c_4 c_5 c_6'


def test_the_matrix_is_the_linear_part_and_well_conditioned() -> None:
    y, phi, theta, v = 0.022, 0.002, -0.01, np.array([1.0, -0.4, 0.7])
    parts = contributions(terms(M, y, phi, theta), v)
    expected = [parts.a[[1, 2, 6]].sum(), parts.b[[1, 2]].sum(), parts.c[[1, 2]].sum()]
    assert input_matrix(M, y, phi, theta) @ v == pytest.approx(expected)
    least, most = condition_range(M, 0.02, TILTS)
    singular = np.linalg.svd(input_matrix(M, 0.02, 0.003, 0.014), compute_uv=False)
    assert 1.0 < least < singular[0] / singular[2] <= most < 5.0
    # Level, and with rows in m/s², the motors' levers are all that is left.
    level = TiltRange(phi=0.0, theta=0.0, steps=1)
    ratio = 2.0 * M.I_x / (M.r**2 * M.M_y)
    expected_ratio = max(ratio, 1.0 / ratio)
    assert condition_range(M, 0.025, level, at_motors=True)[1] == pytest.approx(expected_ratio)


@pytest.fixture
def few_tilts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Corners and centre of the range only: the grid's density is tested above."""
    monkeypatch.setattr(terms_cli, 'TiltRange', lambda **tilts: TiltRange(**tilts, steps=2))


@pytest.mark.usefixtures('few_tilts')
@pytest.mark.parametrize('kind', ['png', 'svg'])
def test_the_command_draws_and_prints(kind: str, tmp_path: Path, capsys: object) -> None:
    out = tmp_path / 'new'
    assert terms_cli.run(['--out', str(out), '--format', kind]) == 0
    data = (out / f'terms.{kind}').read_bytes()
    assert data.startswith(b'\x89PNG') if kind == 'png' else b'</svg>' in data
    assert [path.name for path in out.iterdir()] == [f'terms.{kind}']
    lines = capsys.readouterr().out.splitlines()  # type: ignore[attr-defined]
    hover = next(line for line in lines if 'needed: hover' in line).split()
    assert float(hover[2]) == pytest.approx(hover_current(M, 0.020), abs=0.005)
    b_4 = next(line for line in lines if line.startswith('  b_4 v_y'))
    b_6 = next(line for line in lines if line.startswith('  b_6 v_y'))
    assert b_4.count('!') == 5
    assert b_6.count('> 7 A') == 5


@pytest.mark.parametrize('gaps', [('0.03', '0.02'), ('0.001', '0.02'), ('0.02', 'nan')])
def test_a_wrong_range_of_gaps_is_one_line(
    gaps: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert terms_cli.run(['--gap', *gaps]) == 2
    captured = capsys.readouterr()
    assert captured.out == ''
    assert captured.err.startswith('terms: error: --gap is')
    assert captured.err.count('\n') == 1


@pytest.mark.usefixtures('few_tilts')
def test_an_output_that_cannot_be_written_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / 'file').write_text('')
    assert terms_cli.run(['--out', str(tmp_path / 'file')]) == 2
    assert 'cannot write to' in capsys.readouterr().err


def test_holding_is_the_worst_of_all_tilts() -> None:
    held = holding(M, 0.02, TILTS)
    for phi, theta in TILTS:
        currents = direct_currents(holding_inputs(M, 0.02, phi, theta))
        assert np.abs(currents).max() <= held.current * (1.0 + 1e-12)
    assert held.current > hover_current(M, 0.02)
    assert math.isfinite(float(held.dropped.max()))
