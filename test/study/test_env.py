"""The Gymnasium environment: by its own checker, and with the default law in it."""

from __future__ import annotations

import copy
import math
import pickle
import warnings
from typing import Any

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import ParameterError, build
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import HOVER, References, held

gymnasium = pytest.importorskip('gymnasium', reason='gymnasium comes with the test tools')
from gymnasium.utils.env_checker import check_env  # noqa: E402

from maglev_study.env import SCALES, StageEnv, moves  # noqa: E402


@pytest.mark.parametrize('action', ['accelerations', 'currents'])
def test_gymnasiums_checker_finds_nothing(action: str) -> None:
    made = gymnasium.make('maglev_study.env:MaglevStage-v0', action=action, duration=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        check_env(made.unwrapped)
    assert isinstance(made.unwrapped, StageEnv)
    assert made.action_space.shape == ((8,) if action == 'currents' else (5,))


def episode(env: StageEnv, seed: int) -> tuple[list[Any], np.ndarray]:
    """The default law's observations, rewards and ends, and the true outputs."""
    env.reset(seed=seed)
    steps, true = [], []
    over = False
    while not over:
        observation, reward, lost, truncated, info = env.step(env.default_action())
        steps.append((observation, reward, lost, truncated))
        true.append(info['true'])
        over = lost or truncated
    return steps, np.array(true)


@pytest.mark.parametrize('action', ['accelerations', 'currents'])
def test_the_default_law_in_it_is_the_default_law(action: str) -> None:
    env = StageEnv(
        action=action,
        duration=0.6,
        plant=build(PlantParameters, SMOOTH),
        controller=build(ControllerParameters, SMOOTH),
    )
    steps, true = episode(env, 7)
    assert len(steps) == 600
    assert not any(lost for _, _, lost, _ in steps)
    assert [k for k, step in enumerate(steps) if step[3]] == [599]
    random = np.random.default_rng(7)
    references = moves(random, 0.6, 1e-3)
    seed = int(random.integers(2**31 - 1))
    start = {**SMOOTH, 'initial.position': tuple(HOVER), 'seed': seed}
    found = run(
        Regulator(build(ControllerParameters, SMOOTH)),
        SimulatedStage(build(PlantParameters, start)),
        References(*(part[:601] for part in references)),
    )
    # Actions are single precision.
    np.testing.assert_allclose(true, found.output[1:], rtol=0.0, atol=1e-7)
    rewards = [reward for _, reward, _, _ in steps]
    assert np.mean(rewards[100:]) > 0.8
    again, _ = episode(env, 7)
    assert [step[1] for step in again] == rewards


def test_the_observation_is_what_it_says() -> None:
    env = StageEnv(duration=0.3, course=lambda *_: held(HOVER + 1e-3 * np.array(WAY), 0.31, 1e-3))
    observation, _ = env.reset(seed=1)
    rows = observation.reshape(5, 5) * SCALES
    np.testing.assert_allclose(rows[0], 1e-3 * np.array(WAY), atol=2e-5)
    np.testing.assert_allclose(rows[1:], 0.0, atol=2e-5)
    for _ in range(20):
        observation, _, _, _, info = env.step(np.array([0.2, 0.0, 0.0, 0.0, 0.0], np.float32))
    rows = observation.reshape(5, 5) * SCALES
    np.testing.assert_allclose(rows[2], info['error'], rtol=1e-6)
    assert rows[2, 0] == pytest.approx(0.5 * 2.0 * 0.02**2, rel=0.25)  # 2 m/s² less friction
    assert rows[1, 0] == pytest.approx(2.0 * 0.02, rel=0.25)


SMOOTH = {'encoder.gap_resolution': 0.0, 'encoder.horizontal_resolution': 0.0}
WAY = (1.0, 2.0, -3.0, 0.1, 1.0)


def test_who_lets_go_of_the_platen_has_lost_it() -> None:
    env = StageEnv(action='currents', duration=1.0)
    env.reset(seed=3)
    for _ in range(400):
        _, reward, lost, truncated, _ = env.step(np.zeros(8, np.float32))
        if lost:
            break
    assert lost
    assert reward == 0.0
    assert not truncated


@pytest.mark.parametrize('action', ['accelerations', 'currents'])
@pytest.mark.parametrize('twin', [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_where_it_is_and_by_itself(twin: Any, action: str) -> None:
    env = StageEnv(duration=0.4, action=action)
    env.reset(seed=1)
    for _ in range(150):
        env.step(env.default_action())
    other = twin(env)
    ahead = [env.step(env.default_action()) for _ in range(50)]
    for observation, reward, *_ in ahead:
        again, same, *_ = other.step(other.default_action())
        np.testing.assert_array_equal(again, observation)
        assert same == reward


def test_an_action_of_another_shape_or_without_a_number_is_refused_and_nothing_moves() -> None:
    env, untouched = StageEnv(duration=0.3), StageEnv(duration=0.3)
    for each in (env, untouched):
        each.reset(seed=1)
    for action in (0.1, [0.1], np.zeros(8), np.zeros((5, 1)), [0.0, 0.0, 0.0, 0.0, math.nan]):
        with pytest.raises(ValueError, match=r'it must be numbers of shape \(5,\)'):
            env.step(action)  # type: ignore[arg-type]
    beyond = np.array([math.inf, 0.0, 0.0, 0.0, -2.0], np.float32)
    step, same = env.step(beyond), untouched.step(np.clip(beyond, -1.0, 1.0))
    np.testing.assert_array_equal(step[0], same[0])
    assert step[1] == same[1]


def test_what_it_refuses() -> None:
    with pytest.raises(ParameterError, match="'action' is 'forces', it must be accelerations or"):
        StageEnv(action='forces')
    for duration in (-1.0, 0.0, math.nan, math.inf):
        with pytest.raises(
            ParameterError, match=f"'duration' is {duration} s, it must last a sample"
        ):
            StageEnv(duration=duration)
    with pytest.raises(TypeError, match="'plant' is a dict, it takes PlantParameters"):
        StageEnv(plant={'seed': 1})  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="'sample_time' of plant and controller"):
        StageEnv(plant=build(PlantParameters, {'sample_time': 2e-3}))
    with pytest.raises(ValueError, match="'course' drew 100 samples, an episode has 301"):
        StageEnv(duration=0.3, course=lambda *_: held(HOVER, 0.1, 1e-3)).reset()
