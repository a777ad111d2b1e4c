"""The stops where the centre of mass is aside: tilts and displacements meet them together."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import sqrtm
from scipy.optimize import nnls

from maglev_model.parameters import build, read_yaml
from maglev_plant.arrays import stage_arrays, true_machine
from maglev_plant.effects.balance import mass_matrix
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_plant.stops import apply_coupled_stops

Array = NDArray[np.float64]
PARAMS = Path(__file__).resolve().parents[2] / 'params'
IDEAL = read_yaml(PARAMS / 'ideal.yaml', 'plant')
LOWER = np.array([0.018, -0.05, -0.05, -0.003, -0.014])
UPPER = np.array([0.031, 0.05, 0.05, 0.003, 0.014])


def parameters(**given: Any) -> PlantParameters:
    named = {name.replace('__', '.'): value for name, value in given.items()}
    return build(PlantParameters, {**IDEAL, **named})


def faces(radius: float) -> tuple[Array, Array]:
    """The set of platen positions as ``A q ≤ b``."""
    rows = [*np.eye(5), *-np.eye(5)]
    bounds = [*UPPER, *-LOWER]
    for up, tilt, side in product((1.0, -1.0), (3, 4), (1.0, -1.0)):
        rows.append(np.array([up, 0.0, 0.0, 0.0, 0.0]))
        rows[-1][tilt] = side * radius
        bounds.append(UPPER[0] if up > 0.0 else -LOWER[0])
    return np.array(rows), np.array(bounds)


def nearest(mass: Array, radius: float, wanted: Array) -> Array:
    """Of the set to a point, in the metric of kinetic energy: least distance by NNLS.

    Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23.
    """
    a, b = faces(radius)
    root = np.real(sqrtm(mass))
    scaled, scale = a @ np.linalg.inv(root), 1e-3
    gap = (a @ wanted - b) / scale  # of the way u from it: scaled u <= -gap
    system = np.vstack([-scaled.T, gap])
    u, _ = nnls(system, np.eye(6)[5], maxiter=1000)
    rest = system @ u - np.eye(6)[5]
    way: Array = np.linalg.solve(root, -rest[:5] / rest[5]) * scale
    return wanted + way


SHARE = st.floats(-1.0, 1.0)


@settings(max_examples=150)
@given(
    aside=st.tuples(SHARE, SHARE, SHARE),
    where=st.sampled_from(['below', 'above', 'between']),
    speed=st.lists(SHARE, min_size=5, max_size=5),
    radius=st.sampled_from([0.05, 0.1, 0.397]),
    seed=st.integers(0, 1000),
)
def test_a_step_ends_at_the_nearest_point_and_gains_nothing(
    aside: tuple[float, float, float], where: str, speed: list[float], radius: float, seed: int
) -> None:
    a, b, h = np.array(aside) * [0.004, 0.004, 0.03]
    given_ = parameters(
        effects__balance__aside_x=a,
        effects__balance__aside_z=b,
        effects__balance__below=h,
        stop__seat_radius=radius,
        substeps=1,
    )
    arrays = stage_arrays(given_)
    mass = mass_matrix(given_, true_machine(given_))
    rng = np.random.default_rng(seed)
    start = rng.uniform(LOWER, UPPER) * [1.0, 1.0, 1.0, 0.2, 0.2]
    reach = radius * np.max(np.abs(start[3:]))
    start[0] = {'below': 0.031 - reach, 'above': 0.018 + reach, 'between': 0.025}[where]
    start[1] = rng.choice([start[1], 0.05, -0.05])
    velocity = np.array(speed) * [0.5, 0.5, 0.5, 2.0, 2.0]
    step = given_.sample_time
    wanted = start + step * velocity
    before, state = np.zeros(10), arrays.state
    before[::2], before[1::2] = start, velocity
    state[::2], state[1::2] = wanted, velocity
    arrays.stop_impulse[:] = rng.exponential(0.1, 16) * (rng.random(16) > 0.5)
    apply_coupled_stops(arrays.block[0], before, np.zeros(10))
    a_, b_ = faces(radius)
    assert np.max(a_ @ state[::2] - b_) < 1e-12
    np.testing.assert_allclose(state[::2], nearest(mass, radius, wanted), rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(state[1::2], (state[::2] - start) / step, rtol=0.0, atol=1e-9)
    energy, gained = velocity @ mass @ velocity, state[1::2] @ mass @ state[1::2]
    assert gained <= energy * (1.0 + 1e-9) + 1e-15


@pytest.mark.parametrize('radius', [0.1, 0.397])
def test_a_platen_with_its_weight_aside_rests_exactly(radius: float) -> None:
    stage = SimulatedStage(
        parameters(
            effects__balance__aside_x=0.002,
            effects__balance__aside_z=-0.001,
            effects__balance__below=0.02,
            stop__seat_radius=radius,
        )
    )
    for _ in range(500):
        stage.read()
        stage.write(np.zeros(4), np.zeros(4))
    state = stage.state
    assert state[0] == 0.031
    assert not state[[1, 6, 7, 8, 9]].any()
    assert state[2:6] == pytest.approx(np.zeros(4), abs=1e-15)  # of x and z to rounding
