"""The stops: exact at rest, without energy of their own, and free to leave."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import quad

from maglev_model.machine import machine_constants
from maglev_model.motor import force_coefficients
from maglev_model.parameters import build, read_yaml
from maglev_plant.arrays import stage_arrays
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_plant.stops import apply_stops

PARAMS = Path(__file__).resolve().parents[2] / 'params'
IDEAL = read_yaml(PARAMS / 'ideal.yaml', 'plant')
ZERO = np.zeros(4)


def _stage(ideal: bool = True, **overrides: object) -> SimulatedStage:
    named = {name.replace('__', '.'): value for name, value in overrides.items()}
    return SimulatedStage(build(PlantParameters, {**(IDEAL if ideal else {}), **named}))


def _run(stage: SimulatedStage, samples: int, i_d: float = 0.0) -> NDArray[np.float64]:
    states = []
    for _ in range(samples):
        stage.read()
        stage.write(np.full(4, i_d), ZERO)
        states.append(stage.state)
    return np.array(states)


@pytest.mark.parametrize('ideal', [True, False])
def test_at_rest_nothing_moves(ideal: bool) -> None:
    states = _run(_stage(ideal), 5000)
    assert np.all(states == states[0])
    assert states[0, 0] == 0.031
    assert not states[0, 1:].any()


def test_the_seats_keep_a_resting_platen_level() -> None:
    torque = (0.0, 0.0, 0.0, 0.0, 0.02)
    on_a_point = _run(_stage(stop__seat_radius=0.0, disturbance__constant=torque), 1000)
    assert np.max(np.abs(on_a_point[:, 8])) > 1e-3
    on_seats = _run(_stage(disturbance__constant=torque), 1000)
    assert np.all(on_seats == on_seats[0])


@pytest.mark.parametrize('ideal', [True, False])
def test_the_upper_stop_holds_the_magnets(ideal: bool) -> None:
    stage = _stage(ideal, initial__position=(0.024, 0.0, 0.0, 0.001, -0.005))
    states = _run(stage, 3000)
    assert np.all(states[-500:] == states[-1])
    assert states[-1] == pytest.approx([0.018] + [0.0] * 9, abs=1e-12)
    held = _run(stage, 500, i_d=-6.0)
    assert held[-1] == pytest.approx([0.018] + [0.0] * 9, abs=1e-12)


def test_lift_off_is_free() -> None:
    stage = _stage()
    _run(stage, 100, i_d=-0.19)
    assert stage.state[0] == 0.031
    stage = _stage()
    without_stop = _stage(machine__gap_max=0.035)
    for either in (stage, without_stop):
        either.write(np.full(4, -0.25), ZERO)
    lifted = _run(stage, 100, i_d=-0.25)
    assert lifted[-1, 0] < 0.030
    np.testing.assert_allclose(lifted, _run(without_stop, 100, i_d=-0.25), rtol=0.0, atol=1e-12)


def _vertical_energy(states: NDArray[np.float64], i_d: float) -> NDArray[np.float64]:
    """Kinetic, magnetic (constant i_d) and potential energy of a level platen [J]."""
    m = machine_constants(PlantParameters().machine)
    reference = 0.031

    def pull(gap: float) -> float:
        k_1, k_2, k_3, _ = force_coefficients(m, gap)
        return -k_1 + k_2 * i_d - k_3 * i_d**2

    nodes = np.linspace(0.018, reference, 27)
    work = [4.0 * quad(pull, reference, gap, epsabs=1e-13)[0] for gap in nodes]
    fit = np.polynomial.Chebyshev.fit(nodes, work, 18)
    kinetic = 0.5 * m.M_y * states[:, 1] ** 2
    return np.asarray(kinetic - m.M_y * m.G * states[:, 0] - fit(states[:, 0]))


def test_between_the_stops_energy_is_kept_without_friction() -> None:
    stage = _stage(
        substeps=8,
        initial__position=(0.0302, 0.0, 0.0, 0.0, 0.0),
        initial__velocity=(-0.1, 0.0, 0.0, 0.0, 0.0),
    )
    states = _run(stage, 400)
    moving = states[: int(np.argmax(states[:, 0] <= 0.0181))]
    assert len(moving) > 30
    assert np.max(np.abs(moving[:, 1])) > 0.4
    assert np.ptp(_vertical_energy(moving, 0.0)) < 1e-9


@settings(max_examples=15)
@given(y=st.floats(0.0185, 0.0309), speed=st.floats(-0.3, 0.3), i_d=st.floats(-1.0, 1.0))
def test_impacts_never_add_energy(y: float, speed: float, i_d: float) -> None:
    stage = _stage(
        initial__position=(y, 0.0, 0.0, 0.0, 0.0), initial__velocity=(speed, 0.0, 0.0, 0.0, 0.0)
    )
    stage.write(np.full(4, i_d), ZERO)
    states = _run(stage, 400, i_d)
    energy = _vertical_energy(states, i_d)
    assert np.max(np.diff(energy)) < 1e-7
    assert np.all((states[:, 0] >= 0.018) & (states[:, 0] <= 0.031))


@pytest.mark.parametrize(
    ('axis', 'name', 'limit'),
    [(1, 'x', 0.05), (2, 'z', 0.05), (3, 'phi', 0.003), (4, 'theta', 0.014)],
)
def test_every_axis_has_its_stop(axis: int, name: str, limit: float) -> None:
    force, velocity = np.zeros(5), np.zeros(5)
    force[axis], velocity[axis] = 50.0, 1.0
    locked = np.ones(5, dtype=bool)
    locked[axis] = False
    stage = _stage(
        initial__position=(0.025, 0.0, 0.0, 0.0, 0.0),
        initial__velocity=velocity.tolist(),
        disturbance__constant=force.tolist(),
        guide__locked=locked.tolist(),
    )
    states = _run(stage, 1000)
    assert states[-1, 2 * axis] == limit, name
    assert np.all(states[-200:, 2 * axis] == limit)
    assert not states[-200:, 2 * axis + 1].any()


CONE = st.tuples(
    st.floats(-1e-3, 2e-3),
    st.floats(-0.005, 0.005),
    st.one_of(st.floats(-0.02, 0.02), st.floats(-0.004, 0.004)),
    st.booleans(),
)


@settings(max_examples=200)
@given(target=CONE, radius=st.sampled_from([0.0, 0.05, 0.1, 0.397]), seed=st.integers(0, 1000))
def test_contact_goes_to_the_nearest_point_of_the_allowed_set(
    target: tuple[float, float, float, bool], radius: float, seed: int
) -> None:
    """The nearest point p to q in a convex set has (q - p)·(z - p) ≤ 0 for every z in the set."""
    depth, phi, theta, upper = target
    parameters = build(PlantParameters, {**IDEAL, 'stop.seat_radius': radius, 'substeps': 1})
    arrays = stage_arrays(parameters)
    edge, sign = (0.018, -1.0) if upper else (0.031, 1.0)
    start, step = np.zeros(10), 1e-3
    start[0] = edge
    phi, theta = float(np.clip(phi, -0.003, 0.003)), float(np.clip(theta, -0.014, 0.014))
    wanted = np.array([edge + sign * depth, phi, theta])
    state = arrays.state
    state[:] = 0.0
    state[[0, 6, 8]] = wanted
    state[[1, 7, 9]] = (wanted - start[[0, 6, 8]]) / step
    apply_stops(arrays.block[0], start)
    got = state[[0, 6, 8]]
    assert sign * (got[0] - edge) + radius * np.max(np.abs(got[1:])) <= 1e-12
    weight = np.array([6.9, 0.5268, 0.5268])
    rng = np.random.default_rng(seed)
    tilts = rng.uniform(-1, 1, (50, 2)) * [0.003, 0.014]
    tilts[:10, 1] = tilts[:10, 0]
    tilts[10:20, 1] = -tilts[10:20, 0]
    spare = rng.exponential(1e-3, 50) * (rng.random(50) > 0.3)
    depths = radius * np.max(np.abs(tilts), axis=1) + spare
    allowed = np.column_stack([edge - sign * depths, tilts])
    assert np.max((allowed - got) @ (weight * (wanted - got))) < 1e-12
    assert state[[1, 7, 9]] == pytest.approx((got - start[[0, 6, 8]]) / step, abs=1e-12)


def test_a_tilted_landing_ends_level_and_still() -> None:
    stage = _stage(initial__position=(0.0302, 0.0, 0.0, 0.001, -0.004), guide__viscous=(10.0,) * 5)
    states = _run(stage, 3000)
    assert states[-1] == pytest.approx([0.031] + [0.0] * 9, abs=1e-12)
    seats = states[:, 0] + 0.1 * np.max(np.abs(states[:, [6, 8]]), axis=1)
    assert np.max(seats) <= 0.031 + 1e-12


def test_with_seats_at_the_movers_every_gap_is_stopped() -> None:
    stage = _stage(
        False,
        stop__seat_radius=0.397,
        initial__position=(0.027, 0.0, 0.0, 0.0, 0.008),
        disturbance__constant=(20.0, 0.0, 0.0, 0.0, 3.0),
    )
    states = _run(stage, 2000)
    gaps = states[:, 0] + 0.397 * np.abs(states[:, 8])
    assert np.max(gaps) <= 0.031 + 1e-9


def test_a_locked_gap_limits_the_tilt_on_its_seats() -> None:
    stage = _stage(
        initial__position=(0.0302, 0.0, 0.0, 0.0, 0.0),
        guide__locked=(True, False, False, True, False),
        disturbance__constant=(0.0, 0.0, 0.0, 0.0, 30.0),
    )
    states = _run(stage, 500)
    assert states[-1, 8] == pytest.approx(0.008, abs=1e-12)
    assert np.all(states[:, 0] == 0.0302)


def test_a_locked_tilt_limits_the_gap_on_its_seats() -> None:
    stage = _stage(
        initial__position=(0.0295, 0.0, 0.0, 0.0, 0.01),
        guide__locked=(False, False, False, False, True),
    )
    states = _run(stage, 1500)
    assert states[-1, 0] == pytest.approx(0.030, abs=1e-12)
    assert states[-1, 1] == 0.0
    assert np.all(states[:, 8] == 0.01)
