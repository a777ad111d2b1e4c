"""The loop of all axes at once: it is made of the axes' loops, and what it guarantees holds."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.parameters import ControllerParameters
from maglev_model.axes import AXES
from maglev_model.parameters import ParameterError, build, from_yaml, replace
from maglev_plant.parameters import PlantParameters
from maglev_study.multiloop import NOTHING, MultiLoop, multiloop, structured_bound
from maglev_study.robustness.guarantee import first_unstable

control = pytest.importorskip('control', reason='python-control comes with the test tools')

PLANT = build(PlantParameters, {'amplifier.bandwidth': 2000.0, 'guide.viscous': (0.5,) * 5})
PARAMS = Path(__file__).resolve().parents[2] / 'params'
TILTED = (0.022, 0.0, 0.0, 0.001, 0.006)


@pytest.fixture(scope='module')
def loop() -> MultiLoop:
    """Where no axis is by itself."""
    return multiloop(PLANT, TILTED, speed=0.1)


def poles(matrix: np.ndarray) -> np.ndarray:
    """Slow ones that many axes have are told apart badly: by size."""
    return np.sort(np.abs(np.linalg.eigvals(matrix)))


def test_where_it_is_level_the_loop_is_that_of_each_axis() -> None:
    """Its poles are theirs, and the lags of currents that move nothing."""
    from maglev_study.linear import linearise

    whole = poles(multiloop(PLANT, speed=0.1).closed())
    friction = build(
        PlantParameters,
        {'amplifier.bandwidth': 2000.0, 'guide.viscous': (0.5,) * 5, 'guide.coulomb': (0.0,) * 5},
    )
    single = np.concatenate([poles(linearise(friction, axis=axis).A) for axis in AXES])
    assert len(whole) == len(single) + 3
    np.testing.assert_allclose(whole[3:], np.sort(single), rtol=0.0, atol=2e-4)
    assert whole[:3].max() < 1e-4


def test_one_channel_has_the_margin_of_its_own_loop() -> None:
    """For one loop the bound is the size itself, and python-control has the same."""
    system = control.ss(control.tf([3.0], [1.0, 2.0, 1.0, 0.0]))
    omega = np.geomspace(0.1, 10.0, 50)
    answer = system(1j * omega)
    bound = structured_bound((0.5 * (1.0 - answer) / (1.0 + answer))[:, None, None])
    assert 1.0 / bound.max() == pytest.approx(control.disk_margins(system, omega)[0])


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_bound_lies_above_every_perturbation_and_below_the_norm(seed: int) -> None:
    """Diagonal unitary U: the spectral radius of U M is at most the structured singular value."""
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(4, 4)) + 1j * rng.normal(size=(4, 4))
    matrix = np.diag(10.0 ** rng.uniform(-2.0, 2.0, 4)) @ matrix
    (bound,) = structured_bound(matrix[None])
    assert bound <= np.linalg.norm(matrix, 2) * (1.0 + 1e-9)
    turns = np.exp(2j * np.pi * rng.random((200, 4)))
    assert np.abs(np.linalg.eigvals(turns[:, :, None] * matrix)).max() <= bound * (1.0 + 1e-9)
    scaled = np.diag([1.0, 10.0, 0.01, 3.0])
    (same,) = structured_bound((scaled @ matrix @ np.linalg.inv(scaled))[None])
    assert same == pytest.approx(bound, rel=0.02)


def test_no_gains_within_the_guarantee_make_it_unstable(loop: MultiLoop) -> None:
    current, reading = loop.guarantees()
    assert 3.0 < current.gain < 10.0
    assert reading.gain > 3.0
    assert loop.stable()
    signs = np.random.default_rng(3).uniform(-1.0, 1.0, (100, 8))
    assert all(loop.stable(10.0 ** (current.gain * one / 20.0)) for one in signs)
    found = first_unstable(loop)
    assert current.gain < found < 20.0


def test_it_is_the_least_over_all_frequencies_not_over_some() -> None:
    """At rest the worst one lies between two that are looked at first."""
    loop = multiloop()
    z = np.exp(1j * np.geomspace(10.0, 1000.0, 2000) * loop.period)[:, None, None]
    plant, law = (
        part.output @ np.linalg.solve(z * np.eye(len(part.state)) - part.state, part.input)
        + part.direct
        for part in (loop.plant, loop.controller)
    )
    opened = -law @ plant
    balanced = 0.5 * (np.eye(8) - opened) @ np.linalg.inv(np.eye(8) + opened)
    least = 1.0 / structured_bound(balanced).max()
    assert loop.guarantees()[0].disk == pytest.approx(least, rel=1e-4)


def test_a_sample_late_is_guaranteed_less() -> None:
    gains = [multiloop(PLANT, speed=0.1, delay=delay).guarantees()[0].gain for delay in (0, 1, 8)]
    assert gains[0] > gains[1] > gains[2] == 0.0


def test_what_has_no_loop_of_all_axes() -> None:
    with pytest.raises(ParameterError, match=r"'effects\.\*' of the plant"):
        multiloop(build(PlantParameters, {'effects.friction.model': 'lugre'}))
    other = build(ControllerParameters, {'law': 'maglev_study.none'})
    with pytest.raises(ParameterError, match='law'):
        multiloop(controller=other)
    with pytest.raises(ParameterError, match="'delay' is -1 samples, it must not be negative"):
        multiloop(delay=-1)
    with pytest.raises(ParameterError, match="'speed' is nan, it must be finite"):
        multiloop(speed=math.nan)


def test_an_axis_without_control_has_no_part_in_it() -> None:
    level = build(ControllerParameters, {'phi.controlled': False, 'theta.controlled': False})
    loop, whole = (multiloop(PLANT, speed=0.1, controller=law) for law in (level, None))
    assert len(loop.controller.state) == len(whole.controller.state) * 3 // 5
    assert loop.guarantees() == (NOTHING, NOTHING)  # magnets turn it over: springs are too soft


def test_an_axis_that_is_locked_has_no_part_in_it_either() -> None:
    """The loops that are left are those of the axes, with their margins and not without any."""
    level = build(ControllerParameters, {'phi.controlled': False, 'theta.controlled': False})
    locked = replace(PLANT, {'guide.locked': (False, False, False, True, True)})
    loop, whole = (multiloop(locked, speed=0.1, controller=level), multiloop(PLANT, speed=0.1))
    assert loop.stable()
    assert len(loop.plant.state) == len(whole.plant.state) - 4
    for guaranteed, least in zip(loop.guarantees(), whole.guarantees(), strict=True):
        assert guaranteed.disk >= least.disk > 0.5


def test_the_machine_with_one_motor_has_guarantees() -> None:
    files = (PARAMS / 'machine.yaml', PARAMS / 'single_motor.yaml')
    plant = from_yaml(PlantParameters, 'plant', *files)
    loop = multiloop(plant, controller=from_yaml(ControllerParameters, 'controller', *files))
    assert min(guaranteed.gain for guaranteed in loop.guarantees()) > 6.0
