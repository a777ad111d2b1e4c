"""Friction models against SciPy's integrators, closed forms, and what friction may not do."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rough import HOVER, ONLY_X, ideal_stage, states
from scipy.integrate import solve_ivp

from maglev_model.axes import X
from maglev_plant.simulation import SimulatedStage

LEVEL, M_X, M_Y = 0.171, 10.6, 6.9


def _on_x(model: str, **overrides: object) -> SimulatedStage:
    return ideal_stage(
        guide__coulomb=(0.0, LEVEL, 0.0, 0.0, 0.0),
        guide__locked=ONLY_X,
        effects__friction__model=model,
        **overrides,
    )


def test_lugre_agrees_with_an_adaptive_integrator_through_presliding_and_reversals() -> None:
    force, frequency = 4.0, 2.0
    stage = _on_x(
        'lugre',
        substeps=20,
        disturbance__amplitude=(0.0, force, 0.0, 0.0, 0.0),
        disturbance__frequency=(frequency,) * 5,
        effects__friction__static_ratio=1.3,
    )
    ours = states(stage, 1001)[:, 2 * X]
    stiffness = LEVEL / 20e-6
    damping = 0.6 * math.sqrt(stiffness)

    def rate(t: float, s: np.ndarray) -> list[float]:
        _, v, z = s
        level = LEVEL * (1.0 + 0.3 * math.exp(-((v / 5e-3) ** 2)))
        z_rate = v - abs(v) * z * stiffness / level
        push = force / M_X * math.sin(2.0 * math.pi * frequency * t)
        return [v, push - stiffness * z - damping * z_rate, z_rate]

    time = np.arange(1001) * 1e-3
    theirs = solve_ivp(rate, (0.0, 1.0), [0.0] * 3, 'LSODA', time, rtol=1e-9, atol=1e-13)
    assert np.ptp(theirs.y[0]) > 2e-3
    assert ours == pytest.approx(theirs.y[0], abs=2e-6)
    small = np.abs(theirs.y[0]) < 10e-6  # still presliding
    assert np.abs(ours - theirs.y[0])[:20].max() < 1e-8
    assert small[:20].all()


def test_a_bristle_never_exceeds_what_it_slides_at_however_fast() -> None:
    stage = _on_x('lugre', substeps=1, initial__velocity=(0.0, 0.9, 0.0, 0.0, 0.0))
    bristle = stage.arrays.effects.friction.bristle
    speed, speeds = 0.9, []
    for _ in range(40):
        stage.read()
        assert abs(bristle[X]) <= 20e-6 * (1.0 + 1e-12)
        assert stage.state[3] <= speed
        speed = stage.state[3]
        speeds.append(speed)
    assert speeds[9] - speeds[39] == pytest.approx(LEVEL * 0.030, rel=1e-6)


def test_lugre_on_a_spring_only_loses_energy() -> None:
    stage = _on_x(
        'lugre',
        substeps=20,
        initial__position=(0.025, 0.01, 0.0, 0.0, 0.0),
        effects__cable__stiffness=500.0,
    )
    bristle = stage.arrays.effects.friction.bristle
    stiffness, last = LEVEL * M_X / 20e-6, math.inf
    for _ in range(2500):
        stage.read()
        x, v = stage.state[2], stage.state[3]
        energy = 0.5 * (M_X * v**2 + 500.0 * x**2 + stiffness * bristle[X] ** 2)
        assert energy <= last * (1.0 + 1e-6)
        last = energy
    assert last < 0.1 * 0.5 * 500.0 * 0.01**2


def test_coulomb_friction_stops_after_its_way_and_then_holds_exactly() -> None:
    stage = _on_x('coulomb', initial__velocity=(0.0, 0.1, 0.0, 0.0, 0.0))
    way = states(stage, 1500)
    assert way[-1, 2] == pytest.approx(0.1**2 / (2.0 * LEVEL), rel=1e-3)
    stopped = np.flatnonzero(way[:, 3] == 0.0)[0]
    assert stopped * 1e-3 == pytest.approx(0.1 / LEVEL, abs=2e-3)
    assert np.all(way[stopped:] == way[stopped])


@pytest.mark.parametrize(
    ('ratio', 'share', 'moves'),
    [(1.0, 0.99, False), (1.0, 1.01, True), (1.2, 1.19, False), (1.2, 1.21, True)],
)
def test_what_rests_breaks_away_at_static_friction(ratio: float, share: float, moves: bool) -> None:
    push = (0.0, share * LEVEL * M_X, 0.0, 0.0, 0.0)
    stage = _on_x('coulomb', disturbance__constant=push, effects__friction__static_ratio=ratio)
    assert (states(stage, 200)[-1, 2] != 0.0) == moves


@pytest.mark.parametrize('model', ['tanh', 'lugre', 'coulomb'])
@pytest.mark.parametrize('velocity', [0.004, 0.02])
def test_steady_sliding_meets_stribecks_curve(model: str, velocity: float) -> None:
    """The force that keeps the speed just there, up or down, is F_c (1 + 0.5 exp(-(v/v_s)²))."""
    level = LEVEL * M_X * (1.0 + 0.5 * math.exp(-((velocity / 5e-3) ** 2)))
    change = []
    for push in (0.98 * level, 1.02 * level):
        stage = _on_x(
            model,
            substeps=10,
            guide__coulomb_velocity=(1e-4,) * 5,
            initial__velocity=(0.0, velocity, 0.0, 0.0, 0.0),
            disturbance__constant=(0.0, push, 0.0, 0.0, 0.0),
            effects__friction__static_ratio=1.5,
        )
        if model == 'lugre':
            stage.arrays.effects.friction.bristle[X] = level / (LEVEL * M_X / 20e-6)
        change.append(states(stage, 6)[-1, 3] - velocity)
    assert change[0] == pytest.approx(-0.02 * level / M_X * 5e-3, rel=0.15)
    assert change[1] == pytest.approx(0.02 * level / M_X * 5e-3, rel=0.15)


@pytest.mark.parametrize(('share', 'moves'), [(0.99, False), (1.01, True)])
def test_the_guides_hold_a_torque_by_their_own_friction(share: float, moves: bool) -> None:
    """Guides 2 and 4 at the lever r hold r (F_2 + F_4); spring and magnets have no part in it."""
    torque = share * 0.397 * (0.5 + 0.7)
    stage = ideal_stage(
        guide__locked=(True, True, True, True, False),
        disturbance__constant=(0.0, 0.0, 0.0, 0.0, torque),
        effects__friction__model='coulomb',
        effects__friction__vertical_guides=(0.4, 0.5, 0.6, 0.7),
    )
    assert (states(stage, 100)[-1, 8] != 0.0) == moves


def test_guides_of_their_own_resist_a_lift_with_the_sum() -> None:
    """Sliding up at an even speed, four guides resist as one friction of the axis does."""
    ends = []
    for given_ in (
        {'effects__friction__vertical_guides': (0.4, 0.5, 0.4, 0.5)},
        {'guide__coulomb': (1.8 / M_Y, 0.0, 0.0, 0.0, 0.0)},
    ):
        stage = ideal_stage(
            guide__locked=(False, True, True, True, True),
            initial__velocity=(-0.05, 0.0, 0.0, 0.0, 0.0),
            **given_,
        )
        ends.append(states(stage, 20)[-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)


def test_friction_grows_with_the_tilt_that_presses_the_guides() -> None:
    speeds = []
    for tilt in (0.0, 0.01):
        stage = _on_x(
            'coulomb',
            initial__position=(0.025, 0.0, 0.0, 0.0, tilt),
            initial__velocity=(0.0, 0.1, 0.0, 0.0, 0.0),
            effects__friction__tilt_load=(0.0, 50.0, 0.0, 0.0, 0.0),
        )
        speeds.append(0.1 - states(stage, 11)[-1, 3])
    assert speeds[1] / speeds[0] == pytest.approx(1.0 + 50.0 * 0.01, rel=1e-9)


@settings(max_examples=30)
@given(
    velocity=st.floats(-0.5, 0.5),
    model=st.sampled_from(['tanh', 'coulomb', 'lugre']),
    substeps=st.sampled_from([2, 7]),
)
def test_friction_alone_never_speeds_a_platen_up(
    velocity: float, model: str, substeps: int
) -> None:
    stage = _on_x(model, substeps=substeps, initial__velocity=(0.0, velocity, 0.0, 0.0, 0.0))
    path = states(stage, 30)
    bound = abs(velocity) * (1.0 + 1e-12)
    assert np.abs(path[:, 3]).max() <= bound


def test_a_platen_at_rest_stays_at_rest_with_any_friction() -> None:
    for model in ('tanh', 'coulomb', 'lugre'):
        stage = ideal_stage(
            initial__position=(0.031, *HOVER[1:]),
            guide__coulomb=(0.3, 0.2, 0.1, 1.0, 1.0),
            effects__friction__model=model,
        )
        path = states(stage, 200)
        assert np.all(path == path[0])
