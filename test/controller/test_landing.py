"""The landing the controller makes by itself."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_controller.landing import Landing
from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.parameters import build
from maglev_model.quintic import minimum_jerk, quintic_to_zero, transition_time
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import run
from maglev_study.references import References, held, joined, shaped

PARAMETERS = ControllerParameters()
LOWER = np.array(PARAMETERS.machine.lower_limit)
UPPER = np.array(PARAMETERS.machine.upper_limit)


def way(position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """The landing's samples (n, 3, 5), the last reference in front."""
    landing = Landing(PARAMETERS, position, velocity, acceleration)
    rows = [(position, velocity, acceleration)]
    while not landing.done:
        rows.append(landing.step())
        assert len(rows) < 10_000
    return np.array(rows)


@settings(max_examples=25)
@given(
    share=st.lists(st.floats(0.1, 0.9), min_size=5, max_size=5),
    speed=st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5),
    push=st.lists(st.floats(-1.0, 1.0), min_size=5, max_size=5),
)
def test_from_any_reference_smoothly_to_the_stop(
    share: list[float], speed: list[float], push: list[float]
) -> None:
    """Continuous in position and velocity, within the stops, tilts level, at rest at 31 mm."""
    position = LOWER + np.array(share) * (UPPER - LOWER)
    velocity = np.array(speed) * [0.02, 0.1, 0.1, 0.004, 0.03]
    rows = way(position, velocity, np.array(push) * [0.1, 0.6, 0.6, 0.01, 0.2])
    path, rate = rows[:, 0], rows[:, 1]
    steps = np.diff(path, axis=0) - 0.5e-3 * (rate[1:] + rate[:-1])
    assert np.abs(steps).max() < 1e-6
    push_by_push = np.diff(rate, axis=0) - 0.5e-3 * (rows[1:, 2] + rows[:-1, 2])
    assert np.abs(push_by_push).max() < 1e-4
    assert np.abs(push_by_push[:, 0]).max() < 4e-6
    assert np.all(path >= LOWER - 1e-9)
    assert np.all(path <= UPPER + 1e-9)
    np.testing.assert_allclose(path[-1, [0, 3, 4]], [0.031, 0.0, 0.0], atol=1e-12)
    assert not rows[-1, 1:].any()
    down = path[400:, 0]
    assert np.all(np.diff(down) >= -1e-15)


@pytest.mark.parametrize(
    ('axis', 'start', 'target', 'time'),
    [
        (0, 0.020, 0.027, 0.06),
        (0, 0.030, 0.025, 0.05),
        (1, 0.0, 0.03, 0.12),
        (2, 0.045, -0.045, 0.2),
        (4, -0.010, 0.010, 0.06),
    ],
)
def test_from_any_moment_of_a_fast_move_it_stays_within_the_stops(
    axis: int, start: float, target: float, time: float
) -> None:
    """Where the platen speeds up as well, at up to 16 m/s² and 32 rad/s²."""
    way = target - start
    for share in np.linspace(0.0, 1.0, 60):
        shape = [float(each[0]) for each in minimum_jerk(np.array([share]))]
        state = np.array([[0.025, 0.0, 0.0, 0.0, 0.0], [0.0] * 5, [0.0] * 5])
        state[:, axis] = start + way * shape[0], way * shape[1] / time, way * shape[2] / time**2
        landing = Landing(PARAMETERS, *state)
        path = np.array([landing.step()[0] for _ in range(400)])
        assert np.all(path >= LOWER - 1e-9)
        assert np.all(path <= UPPER + 1e-9)


@pytest.mark.parametrize('lost', [3, 7, 12, 20])
def test_lost_in_a_fast_rise_it_meets_no_stop_hard(lost: int) -> None:
    """5 mm in 45 ms; after so many of them there is no reference any more."""
    low, high = (np.array([y, 0.0, 0.0, 0.0, 0.0]) for y in (0.03, 0.025))
    risen = References(*(column[:lost] for column in shaped(low, high, 0.045, 0.0, 1e-3)))
    landing, descent = Landing(PARAMETERS, *(column[-1] for column in risen)), []
    while not landing.done:
        descent.append(landing.step())
    down = References(*(np.array(column) for column in zip(*descent, strict=True)))
    stage = SimulatedStage(build(PlantParameters, {'initial.position': tuple(low)}))
    flown = run(Regulator(PARAMETERS), stage, joined(held(low, 0.3, 1e-3), risen, down)).state[300:]
    assert flown[:, 0].min() > LOWER[0] + 1e-4
    assert np.abs(np.diff(flown[:, 1])).max() < 0.05


def test_durations_are_the_parameters() -> None:
    """Braking, descent and settling, in samples."""
    rows = way(np.array([0.025, 0, 0, 0, 0.0]), np.zeros(5), np.zeros(5))
    assert len(rows) - 1 == pytest.approx(2400, abs=1)
    assert np.abs(rows[:, 1, 0]).max() == pytest.approx(1.875 * 0.006 / 1.5, rel=1e-3)


@settings(max_examples=40)
@given(
    start=st.tuples(st.floats(-0.05, 0.05), st.floats(-0.2, 0.2), st.floats(-2, 2)),
    duration=st.floats(0.05, 3.0),
)
def test_quintic_meets_both_ends(start: tuple[float, float, float], duration: float) -> None:
    """Start values as given, rest in zero at the end, derivatives those of the position."""
    np.testing.assert_allclose(quintic_to_zero(*start, duration, 0.0), start, atol=1e-12)
    almost = quintic_to_zero(*start, duration, duration * (1.0 - 1e-9))
    np.testing.assert_allclose(almost, 0.0, atol=1e-5)
    assert quintic_to_zero(*start, duration, duration) == (0.0, 0.0, 0.0)
    time, step = 0.37 * duration, 1e-5 * duration
    before, here, after = (
        quintic_to_zero(*start, duration, t) for t in (time - step, time, time + step)
    )
    scale = 1e-4 * (abs(start[0]) / duration + abs(start[1]) + abs(start[2]) * duration + 1e-9)
    assert (after[0] - before[0]) / (2 * step) == pytest.approx(here[1], abs=scale)
    assert (after[1] - before[1]) / (2 * step) == pytest.approx(here[2], abs=scale / duration)


def test_transition_time_keeps_the_acceleration() -> None:
    """The peak acceleration of the profile it gives is the one allowed."""
    duration = transition_time(0.06, 4.0, 0.2)
    peak = max(
        abs(quintic_to_zero(0.06, 0.0, 0.0, duration, t)[2])
        for t in np.linspace(0.0, duration, 2001)
    )
    assert peak == pytest.approx(4.0, rel=1e-4)
    assert transition_time(0.001, 4.0, 0.2) == 0.2


def test_it_may_brake_on_the_lower_stop_itself_but_on_no_other() -> None:
    """Down is where it goes; from those of x and z it keeps away, by 3 % of their way."""
    stop = np.array([UPPER[0], UPPER[1], LOWER[2], 0.0, 0.0])
    rows = way(stop, np.zeros(5), np.zeros(5))
    np.testing.assert_array_equal(rows[:, 0, 0], UPPER[0])
    off = 0.03 * (UPPER - LOWER)
    np.testing.assert_allclose(rows[-1, 0, 1:3], [UPPER[1] - off[1], LOWER[2] + off[2]])
    stop[0] -= 1e-4
    falling = way(stop, np.array([0.02, 0.0, 0.0, 0.0, 0.0]), np.zeros(5))
    braked = round(PARAMETERS.landing.braking_time / PARAMETERS.sample_time)
    assert falling[braked, 0, 0] == pytest.approx(UPPER[0], abs=1e-12)


def test_it_brakes_over_half_of_what_its_speed_would_cover() -> None:
    """So that a constant deceleration would do it; what moves is not thrown back."""
    speed = np.array([0.01, 0.1, -0.06, 0.0, 0.0])
    rows = way(np.array([0.025, 0.0, 0.0, 0.0, 0.0]), speed, np.zeros(5))
    braking = PARAMETERS.landing.braking_time
    gone = rows[round(braking / PARAMETERS.sample_time), 0] - rows[0, 0]
    np.testing.assert_allclose(gone[:3], 0.5 * braking * speed[:3])
