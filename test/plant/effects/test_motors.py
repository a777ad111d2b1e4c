"""Motors that differ, cogging, ends, centre of mass, cable: by conservation and closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from rough import HOVER, ONLY_X, ZERO, M, ideal_stage, magnetic_energy, states

from maglev_model.motor import force_coefficients
from maglev_model.parameters import ParameterError

ASIDE_X, ASIDE_Z, BELOW = 0.004, -0.003, 0.03
MAGNET = (1.03, 0.98, 0.95, 1.01)
CONSERVATIVE = {
    'effects__motor__magnet': MAGNET,
    'effects__motor__place_along': (0.004, -0.003, 0.002, 0.001),
    'effects__motor__place_across': (0.002, -0.001, 0.003, 0.004),
    'effects__motor__angle': (0.01, -0.02, 0.015, 0.005),
    'effects__motor__cogging': 3.0,
    'effects__motor__cogging_phase': (0.1, 0.7, 2.0, -1.0),
    'effects__motor__end_force': 20.0,
    'effects__motor__lateral_force': 30.0,
    'effects__balance__aside_x': ASIDE_X,
    'effects__balance__aside_z': ASIDE_Z,
    'effects__balance__below': BELOW,
    'effects__cable__stiffness': 200.0,
    'effects__spring__growth': 30.0,
}
MOTORS = np.array(
    [[0.002, 0.401], [0.394, -0.001], [0.003, -0.399], [-0.398, 0.004]]
)  # X, Z of the motors
ANGLE = CONSERVATIVE['effects__motor__angle']
PHASE = CONSERVATIVE['effects__motor__cogging_phase']


def platen_energy(s: NDArray[np.float64]) -> float:
    """Kinetic and potential energy, from the positions and speeds of masses and motors."""
    y, v_y, x, v_x, z, v_z, phi, w_phi, theta, w_theta = s
    down = v_y + ASIDE_X * w_theta - ASIDE_Z * w_phi
    along_x, along_z = v_x - BELOW * w_theta, v_z + BELOW * w_phi
    rest = M.I_x - M.M_y * (np.array([ASIDE_Z**2, ASIDE_X**2]) + BELOW**2)
    kinetic = 0.5 * M.M_y * (down**2 + along_x**2 + along_z**2)
    kinetic += 0.5 * ((M.M_x - M.M_y) * v_x**2 + (M.M_z - M.M_y) * v_z**2)
    kinetic += 0.5 * (rest[0] * w_phi**2 + rest[1] * w_theta**2)
    height = y + ASIDE_X * theta - ASIDE_Z * phi - 0.5 * BELOW * (theta**2 + phi**2)
    potential = -M.M_y * M.G * height + 0.5 * 200.0 * (x**2 + z**2)
    potential += (
        0.5 * (1.0 + 30.0 * (y - 0.0245)) * M.I_x * (M.k_s_phi * phi**2 + M.k_s_theta * theta**2)
    )
    wave = 2.0 * math.pi / M.t_1
    for i, (at_x, at_z) in enumerate(MOTORS):
        gap = y + at_x * math.sin(theta) - at_z * math.sin(phi)
        main, other = (z, x) if i % 2 == 0 else (x, z)
        s_i = main * math.cos(ANGLE[i]) + other * math.sin(ANGLE[i])
        u_i = other * math.cos(ANGLE[i]) - main * math.sin(ANGLE[i])
        potential += magnetic_energy(gap, MAGNET[i])
        fading = math.exp(-wave * (gap - 0.018)) / wave
        potential -= 3.0 * math.cos(wave * s_i + PHASE[i]) * fading
        potential += 20.0 * s_i**4 / (4.0 * 0.05**3) + 30.0 * u_i**2 / (2.0 * 0.05)
    return float(kinetic + potential)


def test_without_currents_and_friction_the_platen_keeps_its_energy() -> None:
    stage = ideal_stage(
        substeps=40,
        initial__position=(0.0275, 0.03, -0.02, 0.0005, 0.002),
        initial__velocity=(0.02, -0.3, 0.5, -0.02, 0.03),
        **CONSERVATIVE,
    )
    path = states(stage, 60)
    energy = np.array([platen_energy(s) for s in path[::5]])
    assert np.ptp(path[:, 0]) > 1e-3
    assert np.ptp(path[:, 8]) > 1e-3
    kinetic = 0.5 * M.M_y * path[:, 1] ** 2
    assert np.ptp(kinetic) > 0.01
    # (7) turns by r F_V where (5) would have r cos(theta) F_V: up to 1e-5 of what turns
    assert energy == pytest.approx(np.full(len(energy), energy[0]), abs=1e-5 * np.ptp(kinetic))


def test_a_weight_aside_turns_the_platen_and_one_below_rights_it() -> None:
    free = {'guide__locked': (True, True, True, True, False), 'machine__spring_theta': 0.0}
    aside = ideal_stage(effects__balance__aside_x=0.002, **free)
    plain = ideal_stage(disturbance__constant=(0, 0, 0, 0, 6.9 * 9.81 * 0.002), **free)
    assert states(aside, 20)[-1] == pytest.approx(states(plain, 20)[-1], abs=1e-13)
    tilted = {**free, 'initial__position': (0.025, 0.0, 0.0, 0.0, 0.002)}
    hanging = ideal_stage(effects__balance__below=0.02, **tilted)
    sprung = ideal_stage(**{**tilted, 'machine__spring_theta': 6.9 * 9.81 * 0.02 / 0.5268})
    assert states(hanging, 20)[-1] == pytest.approx(states(sprung, 20)[-1], abs=1e-12)


def test_pushed_along_a_centre_of_mass_below_swings() -> None:
    """Two bodies: (M_x, -M_y h; -M_y h, I) (ẍ, θ̈) = (F, torque)."""
    stage = ideal_stage(
        guide__locked=(True, False, True, True, False),
        machine__spring_theta=0.0,
        machine__gravity=0.0,
        effects__balance__below=0.02,
    )
    stage.write(ZERO, [0.0, -1.0, 0.0, -1.0])
    stage.read()
    stage.read()
    push = 2.0 * force_coefficients(M, 0.025)[3]
    matrix = np.array([[10.6, -6.9 * 0.02], [-6.9 * 0.02, 0.5268]])
    expected = np.linalg.solve(matrix, [push, 0.0]) * 1e-3
    assert stage.state[[3, 9]] == pytest.approx(expected, rel=1e-3)


def test_a_centre_of_mass_too_far_for_the_inertia_is_refused() -> None:
    with pytest.raises(ParameterError, match=r'effects.balance.*inertia'):
        ideal_stage(machine__inertia=0.01, effects__balance__below=0.05)


@pytest.mark.parametrize('motor', [0, 1, 2, 3])
def test_strength_place_and_commutation_of_each_motor_act_as_printed(motor: int) -> None:
    """One motor's share of the accelerations after a short time, from (1), (2) with its values."""

    def factors(value: float, other: float) -> tuple[float, ...]:
        return tuple(value if i == motor else other for i in range(4))

    i_d, i_q, m, w, offset = 0.8, 0.6, 1.1, 0.9, 0.3
    common = {'amplifier__bandwidth': 0.0, 'sample_time': 1e-4, 'substeps': 1}
    changed = ideal_stage(
        effects__motor__magnet=factors(m, 1.0),
        effects__motor__winding=factors(w, 1.0),
        effects__motor__place_along=factors(0.02, 0.0),
        effects__motor__commutation=factors(offset, 0.0),
        **common,
    )
    plain = ideal_stage(**common)
    for stage in (changed, plain):
        stage.write(np.full(4, i_d), np.full(4, i_q))
        stage.read()
        stage.read()
    k_1, k_2, k_3, k_h = force_coefficients(M, 0.025)
    d = i_d * math.cos(offset) + i_q * math.sin(offset)
    q = i_q * math.cos(offset) - i_d * math.sin(offset)
    down = -m * m * k_1 + m * w * k_2 * d - w * w * k_3 * (d * d + q * q)
    nominal = -k_1 + k_2 * i_d - k_3 * (i_d**2 + i_q**2)
    along = -k_h * (m * w * q - i_q)
    found = (changed.state - plain.state)[1::2] / 1e-4
    axis, mass = (2, 8.6) if motor % 2 == 0 else (1, 10.6)
    tilt, sign = (3, (-1, 0, 1, 0)[motor]) if motor % 2 == 0 else (4, (0, 1, 0, -1)[motor])
    assert found[0] == pytest.approx((down - nominal) / 6.9, rel=1e-3)
    assert found[axis] == pytest.approx(along / mass, rel=1e-3)
    torque = sign * (0.417 * down - 0.397 * nominal)
    assert found[tilt] == pytest.approx(torque / 0.5268, rel=1e-3)


def test_a_turned_motor_counts_its_electrical_angle_along_itself() -> None:
    """Aside, it is displaced along itself as well, of which the commutation does not know."""
    turned, aside, locked = 0.1, 0.03, {'guide__locked': (True,) * 5}
    place = {'initial__position': (0.025, 0.01, aside, 0.0, 0.0), **locked}
    along = 0.01 * math.cos(turned) + aside * math.sin(turned)
    missed = math.pi / M.tau * (along - 0.01)
    assert missed > 0.1
    found = []
    for name, value in (('angle', turned), ('commutation', missed)):
        stage = ideal_stage(**{f'effects__motor__{name}': (0.0, value, 0.0, 0.0)}, **place)
        stage.write(np.full(4, 0.8), np.full(4, 0.6))
        states(stage, 5)
        found.append([*stage.direct_current, *stage.quadrature_current])
    assert found[0] == pytest.approx(found[1], abs=1e-12)
    assert found[0][1] == pytest.approx(0.8 * math.cos(missed) + 0.6 * math.sin(missed), rel=1e-6)
    assert found[0][0] == pytest.approx(0.8, rel=1e-6)


def test_spread_is_drawn_by_the_seed() -> None:
    drawn = [
        ideal_stage(seed=seed, effects__motor__spread=0.03).arrays.effects.motors
        for seed in range(200)
    ]
    magnets = np.array([motors.magnet for motors in drawn])
    assert magnets.mean() == pytest.approx(1.0, abs=0.004)
    assert magnets.std() == pytest.approx(0.03, rel=0.1)
    again = ideal_stage(seed=7, effects__motor__spread=0.03).arrays.effects.motors
    assert list(again.magnet) == list(magnets[7])
    correlation = np.corrcoef(magnets.T, np.array([motors.winding for motors in drawn]).T)
    assert np.abs(correlation - np.eye(8)).max() < 0.25


def test_ripple_goes_with_a_third_of_the_pole_pitch() -> None:
    thrust = []
    for x in (0.0, 0.05715 / 6.0, 0.05715 / 3.0):
        stage = ideal_stage(
            initial__position=(0.025, x, 0.0, 0.0, 0.0),
            guide__locked=ONLY_X,
            effects__motor__ripple=0.01,
        )
        stage.write(ZERO, [1.0] * 4)
        thrust.append(states(stage, 3)[-1, 3])
    assert thrust[1] / thrust[0] == pytest.approx(0.99 / 1.01, rel=1e-4)
    assert thrust[2] / thrust[0] == pytest.approx(1.0, rel=1e-4)


def test_the_cable_swings_the_platen_and_its_hysteresis_takes_energy() -> None:
    stage = ideal_stage(
        initial__position=(0.025, 0.01, 0.0, 0.0, 0.0),
        guide__locked=ONLY_X,
        substeps=10,
        effects__cable__stiffness=10.6 * 100.0,
    )
    t = np.arange(400) * 1e-3
    assert states(stage, 400)[:, 2] == pytest.approx(0.01 * np.cos(10.0 * t), abs=1e-9)
    stage = ideal_stage(
        initial__velocity=(0.0, 0.02, 0.0, 0.0, 0.0),
        guide__locked=ONLY_X,
        substeps=10,
        effects__cable__hysteresis=0.2,
    )
    v, x = states(stage, 300)[-1, [3, 2]]
    # Dahl: F = 0.2 (1 - exp(-x / 1 mm)); what the bristle has taken is the kinetic energy's loss
    taken = 0.2 * (x + 1e-3 * math.expm1(-x / 1e-3))
    assert 0.5 * 10.6 * (0.02**2 - v**2) == pytest.approx(taken, rel=1e-3)


def test_warm_magnets_pull_less_and_take_their_time() -> None:
    def lift(**heat: object) -> float:
        stage = ideal_stage(
            guide__locked=(False, True, True, True, True), machine__gravity=0.0, **heat
        )
        return float(states(stage, 3)[-1, 1])

    cold = lift()
    weaker = (1.0 - 1.1e-3 * 20.0) ** 2
    assert lift(effects__heat__magnets=20.0) / cold == pytest.approx(weaker, rel=1e-4)
    slow = {'effects__heat__magnets': 20.0, 'effects__heat__time': 2e-3}
    rises = [-math.expm1(-t / 2e-3) for t in (0.0, 1e-3)]
    expected = np.mean([(1.0 - 1.1e-3 * 20.0 * rise) ** 2 for rise in rises])
    assert lift(**slow) / cold == pytest.approx(expected, rel=1e-3)


def test_the_floor_shakes_every_third_octave_alike() -> None:
    """Where nothing holds the platen it stays, seen from the floor moving by minus the floor."""
    stage = ideal_stage(
        guide__locked=(True, False, False, True, True),
        substeps=4,
        seed=3,
        effects__floor__velocity=1e-3,
    )
    time = np.arange(10_000) * 1e-3
    path = states(stage, 10_000)
    frequencies = 10.0 ** (np.arange(20) / 10.0)
    waves = np.concatenate(
        [f(2.0 * np.pi * frequencies * time[:, None]) for f in (np.cos, np.sin)], axis=1
    )
    for axis in (1, 2):
        fitted, *_ = np.linalg.lstsq(
            np.column_stack([waves, np.ones(10_000)]), path[:, 2 * axis + 1], rcond=None
        )
        size = np.hypot(fitted[:20], fitted[20:40]) / math.sqrt(2.0)
        assert size == pytest.approx(np.full(20, 1e-3), rel=2e-2)
    assert abs(np.corrcoef(path[:, 3], path[:, 5])[0, 1]) < 0.9
    assert HOVER[0] == path[-1, 0]
