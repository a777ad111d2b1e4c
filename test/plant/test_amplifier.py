"""Current lag, phase peaks and the thermal budget of the amplifiers."""

from __future__ import annotations

import math

import numpy as np
import pytest

from maglev_model.commutation import phase_currents
from maglev_model.parameters import build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage

STILL = {'guide.locked': (True,) * 5, 'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0)}


def _stage(**overrides: object) -> SimulatedStage:
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    stage = SimulatedStage(build(PlantParameters, {**STILL, **named}))
    stage.read()
    return stage


def test_the_current_loop_is_first_order() -> None:
    stage = _stage(amplifier__bandwidth=100.0)
    stage.write([2.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0])
    for k in range(1, 8):
        stage.read()
        rise = 1.0 - math.exp(-2.0 * math.pi * 100.0 * 1e-3 * k)
        assert stage.direct_current == pytest.approx([2.0 * rise, 0.0, 0.0, 0.0], abs=1e-12)
        assert stage.quadrature_current == pytest.approx([0.0, 0.0, 0.0, -rise], abs=1e-12)


@pytest.mark.parametrize('bandwidth', [30.0, 2000.0])
def test_a_decaying_current_gives_its_exact_impulse_and_displacement(bandwidth: float) -> None:
    """Along X the force is proportional to i_q: speed and place follow by two integrations."""
    stage = SimulatedStage(
        build(
            PlantParameters,
            {
                'initial.position': (0.025, 0.0, 0.0, 0.0, 0.0),
                'guide.locked': (True, False, True, True, True),
                'guide.coulomb': (0.0,) * 5,
                'guide.viscous': (0.0,) * 5,
                'amplifier.bandwidth': bandwidth,
                'substeps': 1,
            },
        )
    )
    stage.read()
    stage.write(np.zeros(4), [0.0, 1.0, 0.0, 1.0])
    for _ in range(20):
        stage.read()
    push = -2.0 * 24.96620702010657 / 10.6  # -2 K_h L_h / M_x at 25 mm
    t, w = 0.020, 2.0 * math.pi * bandwidth
    left = 1.0 - math.exp(-w * t)
    speed = push * (t - left / w)
    place = push * (t**2 / 2.0 - t / w + left / w**2)
    assert stage.state[3] == pytest.approx(speed, rel=1e-9)
    assert stage.state[2] == pytest.approx(place, rel=1e-9)


def test_without_lag_the_command_flows_at_once() -> None:
    stage = _stage(amplifier__bandwidth=0.0)
    stage.write([1.0, -2.0, 0.5, 0.0], [0.1, 0.2, 0.3, 0.4])
    stage.read()
    assert list(stage.direct_current) == [1.0, -2.0, 0.5, 0.0]
    assert list(stage.quadrature_current) == [0.1, 0.2, 0.3, 0.4]


def test_no_phase_exceeds_its_peak_wherever_the_platen_is() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        x, z = rng.uniform(-0.05, 0.05, 2)
        stage = _stage(
            amplifier__bandwidth=0.0, initial__position=(0.025, float(x), float(z), 0.0, 0.0)
        )
        stage.write(rng.uniform(-20, 20, 4), rng.uniform(-20, 20, 4))
        stage.read()
        for motor in range(4):
            angle = math.pi * (z if motor % 2 == 0 else x) / 0.05715
            flowing = stage.direct_current[motor], stage.quadrature_current[motor]
            phases = np.array(phase_currents(*flowing, angle))
            spread = np.ptp(phases)  # what the phases have in common makes no field
            assert spread <= 14.0 + 1e-9


def test_a_large_quadrature_current_costs_direct_current() -> None:
    stage = _stage(amplifier__bandwidth=0.0)
    stage.write([-3.0] * 4, [12.0, 0.0, 12.0, 0.0])
    stage.read()
    assert list(stage.direct_current[[1, 3]]) == [-3.0, -3.0]
    # At angle 0 phase a carries i_d; b and c, -i_d/2 ± √3/2 i_q, are clipped from 11.9 and -8.9.
    assert stage.direct_current[0] == pytest.approx(-2.0)
    assert stage.quadrature_current[0] == pytest.approx(14.0 / math.sqrt(3.0))


@pytest.mark.parametrize('scaling', ['amplitude', 'rms'])
def test_a_current_up_to_the_peak_flows_by_either_scaling(scaling: str) -> None:
    stage = _stage(amplifier__bandwidth=0.0, machine__dq_scaling=scaling)
    stage.write([6.9] * 4, [0.0] * 4)
    stage.read()
    assert list(stage.direct_current) == [6.9] * 4


def test_the_thermal_budget_is_spent_clips_and_recovers() -> None:
    stage = _stage(amplifier__bandwidth=0.0)
    stage.write([7.0, 0.0, 4.9, 0.0], [0.0] * 4)
    spent = None
    for k in range(1, 4000):
        stage.read()
        if spent is None and stage.direct_current[0] < 7.0:
            spent = k
    # load = (7/5)² (1 - exp(-t / 2 s)) reaches 1 after 2 s ln(1.96 / 0.96)
    assert spent == pytest.approx(2000.0 * math.log(1.96 / 0.96), abs=2)
    assert stage.direct_current[0] == pytest.approx((2 * 5.0 + 3.5 + 3.5) / 3.0)
    assert stage.direct_current[2] == 4.9
    assert stage.thermal_load[0] == pytest.approx(1.0, abs=1e-3)
    assert stage.thermal_load[1] == 0.0
    assert 0.5 < stage.thermal_load[2] < 0.97
    stage.write([0.0] * 4, [0.0] * 4)
    for _ in range(300):
        stage.read()
    assert stage.thermal_load[0] < 0.9
    stage.write([7.0] * 4, [0.0] * 4)
    stage.read()
    assert stage.direct_current[0] == 7.0


def test_the_continuous_rating_is_carried_for_ever() -> None:
    stage = _stage(amplifier__bandwidth=0.0, amplifier__thermal_time=0.05)
    stage.write([5.0] * 4, [0.0] * 4)
    for _ in range(2000):
        stage.read()
        assert stage.direct_current[0] == 5.0
    assert stage.thermal_load == pytest.approx(np.ones(4), abs=1e-9)
