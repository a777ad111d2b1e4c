"""Windings by co-energy: the inductance, closed forms of the current, and energy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from rough import ZERO, M, ideal_stage, magnetic_energy
from scipy.integrate import quad

from maglev_model.motor import force_coefficients
from maglev_model.parameters import ParameterError, build
from maglev_plant.effects.winding import inductance
from maglev_plant.parameters import PlantParameters

STILL = (True,) * 5
WINDING = {'effects__winding__voltage': 28.0, 'effects__winding__resistance': 4.0}


def _inductance(gap: float) -> float:
    """By quadrature of co-energy's slope, from 45 mH at 31 mm."""
    grown, _ = quad(lambda g: 4.0 / 3.0 * force_coefficients(M, g)[2], gap, 0.031)
    return 0.045 + float(grown)


@pytest.mark.parametrize('gap', [0.0125, 0.018, 0.02, 0.0271, 0.031, 0.035])
def test_the_inductance_is_the_integral_of_its_coenergy(gap: float) -> None:
    winding = ideal_stage(**WINDING).arrays.effects.winding
    assert inductance(winding.block[0], 1.0, gap) == pytest.approx(_inductance(gap), abs=5e-9)


def test_it_changes_by_93_or_47_millihenry_between_20_and_30_mm() -> None:
    for scaling, change in (('amplitude', 93.2e-3), ('rms', 46.6e-3)):
        block = ideal_stage(machine__dq_scaling=scaling).arrays.effects.winding.block[0]
        found = inductance(block, 1.0, 0.02) - inductance(block, 1.0, 0.03)
        assert found == pytest.approx(change, rel=5e-3)


def test_an_inductance_that_k_v3_would_make_negative_is_refused() -> None:
    with pytest.raises(ParameterError, match=r'effects.winding.inductance.*widest gap'):
        ideal_stage(**WINDING, effects__winding__inductance=0.01)
    with pytest.raises(ParameterError, match=r'effects.winding.inductance.*widest gap'):
        ideal_stage(**WINDING, effects__motor__winding=(1.0, 1.5, 1.0, 1.0))


def test_seats_beyond_the_motors_leave_their_gaps_the_whole_range() -> None:
    wide = build(PlantParameters, {'stop.seat_radius': 1.0})
    assert wide.motor_gaps == (wide.machine.gap_min, wide.machine.gap_max)


def test_against_the_rail_a_current_rises_as_resistance_and_inductance_let_it() -> None:
    stage = ideal_stage(guide__locked=STILL, substeps=10, **WINDING)
    stage.write([6.0] * 4, ZERO)
    time = np.arange(1, 16) * 1e-3
    found = []
    stage.read()
    for _ in time:
        stage.read()
        found.append(stage.arrays.effects.winding.phase[0])
    rise = 7.0 * -np.expm1(-4.0 / _inductance(0.025) * time)
    assert found == pytest.approx(rise, rel=1e-5)
    assert found[0] == pytest.approx(28.0 / _inductance(0.025) * 1e-3, rel=0.03)  # 0.28 A/ms


def test_where_the_rail_does_not_limit_the_loop_is_first_order() -> None:
    stage = ideal_stage(guide__locked=STILL, substeps=4, amplifier__bandwidth=100.0, **WINDING)
    stage.write([0.04] * 4, ZERO)
    for k in range(6):
        stage.read()
        expected = 0.04 * -math.expm1(-2.0 * math.pi * 100.0 * 1e-3 * k)
        assert stage.direct_current == pytest.approx([expected] * 4, abs=1e-12)
    assert not stage.arrays.effects.winding.limited


def test_the_back_emf_takes_its_share_of_the_rail() -> None:
    """17 V per m/s at 25 mm, as the peak of a phase: at 1 m/s it drives a shorted winding."""
    speed = 0.2
    stage = ideal_stage(
        guide__locked=(True, False, True, True, True),
        initial__velocity=(0.0, speed, 0.0, 0.0, 0.0),
        machine__mass_x=1000.0,
        substeps=20,
        effects__winding__voltage=1e-9,
        effects__winding__resistance=0.0,
    )
    stage.read()
    stage.write(ZERO, ZERO)
    stage.read()
    volts = 2.0 / 3.0 * force_coefficients(M, 0.025)[3] * speed
    assert volts == pytest.approx(16.6 * speed, rel=0.01)
    rise = volts / _inductance(0.025) * 1e-3
    assert stage.quadrature_current[[1, 3]] == pytest.approx([rise] * 2, rel=1e-3)
    assert stage.quadrature_current[[0, 2]] == pytest.approx([0.0] * 2, abs=1e-12)


def test_shorted_windings_without_resistance_keep_the_energy_of_platen_and_field() -> None:
    """Currents flow, the platen falls and slides; what it loses the fields take, and back."""
    stage = ideal_stage(
        initial__position=(0.0265, 0.01, -0.012, 0.0, 0.002),
        initial__velocity=(0.05, 0.4, -0.3, 0.0, 0.05),
        substeps=40,
        effects__winding__voltage=1e-9,
        effects__winding__resistance=0.0,
    )
    phase = stage.arrays.effects.winding.phase
    for motor, i_d in enumerate((0.5, -0.7, 0.6, 0.4)):
        angle = math.pi / M.tau * (stage.state[4] if motor % 2 == 0 else stage.state[2])
        phase[3 * motor : 3 * motor + 3] = i_d * np.cos(
            angle - np.array([0.0, 2.0, 4.0]) * math.pi / 3.0
        )

    def energy() -> tuple[float, float]:
        y, phi, theta = stage.state[[0, 6, 8]]
        v_y, v_x, v_z, w_phi, w_theta = stage.state[1::2]
        gaps = y + M.r * np.array(
            [-math.sin(phi), math.sin(theta), math.sin(phi), -math.sin(theta)]
        )
        total = 0.5 * (M.M_y * v_y**2 + M.M_x * v_x**2 + M.M_z * v_z**2)
        total += 0.5 * M.I_x * (w_phi**2 + w_theta**2) - M.M_y * M.G * y
        total += 0.5 * M.I_x * (M.k_s_phi * phi**2 + M.k_s_theta * theta**2)
        field = 0.0
        for i, gap in enumerate(gaps):
            total += magnetic_energy(gap, 1.0)
            field += 0.5 * _inductance(gap) * float(np.sum(phase[3 * i : 3 * i + 3] ** 2))
        return total, field

    start = energy()
    exchanged = []
    stage.read()
    for _ in range(30):
        stage.read()
        now = energy()
        exchanged.append(now[1] - start[1])
        assert sum(now) == pytest.approx(sum(start), abs=1e-6)
    assert np.ptp(exchanged) > 0.02
    assert abs(stage.state[0] - 0.0265) > 4e-4


def test_warm_copper_lets_less_through() -> None:
    currents = []
    for rise in (0.0, 50.0):
        stage = ideal_stage(guide__locked=STILL, substeps=4, effects__heat__copper=rise, **WINDING)
        stage.write([7.0] * 4, ZERO)
        for _ in range(400):
            stage.read()
        currents.append(stage.arrays.effects.winding.phase[0])
    assert currents[1] / currents[0] == pytest.approx(1.0 / (1.0 + 3.9e-3 * 50.0), rel=1e-3)
