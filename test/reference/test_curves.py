"""Curves and waypoints: derivatives by differences, and the geometry each is named after."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.parameters import ParameterError, build
from maglev_model.quintic import minimum_jerk_time
from maglev_reference.accuracy import warnings
from maglev_reference.curves import Chirp, Helix, Sinusoids, Square
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.trajectories import course
from maglev_reference.trajectory_parameters import (
    ChirpParameters,
    CircleParameters,
    HelixParameters,
    LissajousParameters,
    SquareParameters,
    WaypointParameters,
)
from maglev_reference.waypoints import Waypoints

HOME = np.array([0.025, 0.004, -0.003, 0.0005, -0.001])
SAMPLE = 1e-3
OMEGA = 1.7  # of the internal models [rad/s]
OWN = {
    'sinusoids': {f'sinusoids.{axis}.frequency': (2.0 * OMEGA,) for axis in ('y', 'x', 'theta')},
    'circle': {'circle.frequency': 2.0 * OMEGA},
    'helix': {'helix.frequency': 2.0 * OMEGA},
    'lissajous': {'lissajous.fundamental': 2.0 * OMEGA},
}
"""The same trajectories at twice that frequency, by themselves."""


def assert_derivatives(motion, time):
    """Velocity and acceleration are the derivatives of position and velocity."""
    step = 1e-6
    before, now, after = (motion.evaluate(time + shift) for shift in (-step, 0.0, step))
    for values, rate in ((0, now.velocity), (1, now.acceleration)):
        slope = (after[values] - before[values]) / (2.0 * step)
        scale = max(1e-3, np.abs(rate).max())
        assert np.abs(slope - rate).max() < 2e-4 * scale


def grid(start, end, seed=0):
    return np.sort(np.random.default_rng(seed).uniform(start, end, 400))


@given(st.floats(0.001, 0.05), st.floats(0.1, 30.0))
@settings(max_examples=20)
def test_a_circle_is_round_and_closes(radius, frequency):
    circle = Sinusoids.circle(CircleParameters(radius=radius, frequency=frequency), HOME, OMEGA)
    time = np.linspace(-1.0, 5.0, 300)
    found = circle.evaluate(time)
    away = found.position - HOME
    assert np.hypot(away[:, 1], away[:, 2]) == pytest.approx(radius, rel=1e-12)
    assert not away[:, [0, 3, 4]].any()
    speed = np.hypot(found.velocity[:, 1], found.velocity[:, 2])
    assert speed == pytest.approx(radius * frequency, rel=1e-12)
    again = circle.evaluate(time + 2.0 * math.pi / frequency)
    assert again.position == pytest.approx(found.position, abs=1e-12)
    assert_derivatives(circle, time)


@given(
    st.tuples(st.floats(0.0, 0.05), st.floats(0.0, 0.05)),
    st.tuples(st.floats(0.018, 0.031), st.floats(0.018, 0.031)),
    st.integers(1, 6),
    st.floats(0.5, 10.0),
)
@settings(max_examples=25)
def test_a_helix_lies_on_its_cone(radius, gap, turns, frequency):
    helix = Helix(
        HelixParameters(radius=radius, gap=gap, turns=turns, frequency=frequency), HOME, OMEGA
    )
    assert helix.period == pytest.approx(2.0 * turns * 2.0 * math.pi / frequency)
    time = grid(-0.5 * helix.period, 1.5 * helix.period)
    found = helix.evaluate(time)
    distance = np.hypot(found.position[:, 1] - HOME[1], found.position[:, 2] - HOME[2])
    share = (distance - radius[0]) / (radius[1] - radius[0]) if radius[0] != radius[1] else None
    if share is not None and abs(radius[0] - radius[1]) > 1e-4:
        on_cone = gap[0] + (gap[1] - gap[0]) * share
        assert found.position[:, 0] == pytest.approx(on_cone, abs=1e-9)
    ends = helix.evaluate(np.array([0.0, 0.5 * helix.period, helix.period]))
    assert ends.position[:, 0] == pytest.approx([gap[0], gap[1], gap[0]], abs=1e-15)
    assert ends.velocity[:, 0] == pytest.approx(0.0, abs=1e-15)
    assert_derivatives(helix, time)


def test_a_helix_rises_evenly_between_its_ends():
    helix = Helix(HelixParameters(turns=4, frequency=5.0), HOME, OMEGA)
    turn = 2.0 * math.pi / 5.0
    found = helix.evaluate(np.linspace(0.26 * turn, 3.74 * turn, 200))
    assert found.velocity[:, 0] == pytest.approx(found.velocity[0, 0], rel=1e-12)
    assert found.velocity[0, 0] > 0.0
    assert found.acceleration[:, 0] == pytest.approx(0.0, abs=1e-15)


@given(st.floats(0.01, 0.1), st.floats(0.05, 0.99), st.floats(0.01, 0.5))
@settings(max_examples=20)
def test_a_square_has_constant_speed_and_its_corner_radius(side, share, speed):
    corner = 0.288 * side * share  # of the largest
    square = Square(SquareParameters(side=side, corner=corner, speed=speed), HOME)
    time = square.period * np.linspace(-0.125, 1.125, 1001)  # the middles of corners among them
    found = square.evaluate(time)
    assert np.hypot(found.velocity[:, 1], found.velocity[:, 2]) == pytest.approx(speed, rel=1e-12)
    bend = np.hypot(found.acceleration[:, 1], found.acceleration[:, 2])
    assert bend.max() == pytest.approx(speed**2 / corner, rel=1e-9)
    assert bend.max() <= speed**2 / corner * (1.0 + 1e-9)
    away = found.position[:, 1:3] - HOME[1:3]
    assert np.abs(away).max(axis=0) == pytest.approx(0.5 * side, abs=1e-12)
    assert np.abs(away).sum(axis=1).max() < side - 0.2 * corner  # its corners are cut
    again = square.evaluate(time + square.period)
    assert again.position == pytest.approx(found.position, abs=1e-12)
    turned = square.evaluate(time + 0.25 * square.period).position[:, 1:3] - HOME[1:3]
    assert turned == pytest.approx(away @ np.array([[0.0, 1.0], [-1.0, 0.0]]), abs=1e-12)
    assert_derivatives(square, time)


def test_corners_larger_than_their_square_are_refused():
    with pytest.raises(ParameterError, match=r"'square.corner' is 0.02 m, it must be at most 0.01"):
        Square(SquareParameters(side=0.06, corner=0.02), HOME)
    Square(SquareParameters(side=0.06, corner=0.0173), HOME)


@given(st.floats(1.0, 60.0), st.floats(1.0, 60.0), st.floats(0.5, 20.0))
@settings(max_examples=20)
def test_a_chirp_sweeps_evenly_and_ends_where_it_stands(start, end, duration):
    parameters = ChirpParameters(axis='z', amplitude=0.001, frequency=(start, end), time=duration)
    chirp = Chirp(parameters, HOME)
    half = math.pi / (0.5 * (start + end))
    assert abs(chirp.length - duration) <= max(0.5 * half, half - duration) + 1e-12
    ends = chirp.evaluate(np.array([0.0, chirp.length]))
    assert ends.velocity[:, 2] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(ends.acceleration[:, 2]) == pytest.approx(
        [0.001 * start**2, 0.001 * end**2], rel=1e-9
    )
    assert_derivatives(chirp, grid(-1.0, chirp.length + 1.0))
    time = np.linspace(0.0, chirp.length, 200)
    found = chirp.evaluate(time)
    away = (found.position - HOME)[:, 2]
    frequency = start + (end - start) * time / chirp.length
    # on the ellipse of a sinusoid of that frequency
    assert np.hypot(away, found.velocity[:, 2] / frequency) == pytest.approx(0.001, rel=1e-9)


def test_a_lissajous_figure_keeps_its_ratios():
    parameters = LissajousParameters(
        fundamental=2.0,
        amplitude=(0.001, 0.02, 0.03, 0.0, 0.001),
        multiple=(1, 2, 3, 1, 5),
        phase=(0.1, 0.2, 0.3, 0.0, 0.5),
    )
    time = np.linspace(0.0, 7.0, 100)
    found = Sinusoids.lissajous(parameters, HOME, OMEGA).evaluate(time).position - HOME
    for axis, order in ((0, 1), (1, 2), (2, 3), (4, 5)):
        wanted = parameters.amplitude[axis] * np.sin(2.0 * order * time + parameters.phase[axis])
        assert found[:, axis] == pytest.approx(wanted, abs=1e-15)
    assert not found[:, 3].any()


@pytest.mark.parametrize('trajectory', ['sinusoids', 'circle', 'helix', 'lissajous'])
def test_a_frequency_that_is_given_once_is_flown_and_held(trajectory):
    """Without a frequency of its own a course follows the internal models, and they it."""
    values = {'trajectory': trajectory, 'lissajous.fundamental': 0.0, 'helix.turns': 1}
    values |= {f'sinusoids.{axis}.amplitude': (1e-3,) for axis in ('y', 'x', 'theta')}
    table = build(ReferenceParameters, {**values, 'internal_model.fundamental': OMEGA})
    period = course(table).period
    assert period == pytest.approx(2.0 * math.pi / OMEGA * (2.0 if trajectory == 'helix' else 1.0))
    own = build(ReferenceParameters, {**values, **OWN[trajectory]})
    assert course(own).period == pytest.approx(0.5 * period)
    if trajectory != 'helix':  # whose gap goes at half the frequency
        assert warnings(table) == []
        assert 'does not hold' in warnings(own)[0]
        assert warnings(own)[-1].startswith('internal models to match')


points = st.lists(
    st.tuples(
        st.floats(0.019, 0.03),
        st.floats(-0.05, 0.05),
        st.floats(-0.05, 0.05),
        st.floats(-0.003, 0.003),
        st.floats(-0.014, 0.014),
    ),
    min_size=1,
    max_size=5,
)


@given(points, st.floats(0.0, 0.5), st.booleans())
@settings(max_examples=25)
def test_waypoints_are_reached_at_rest_within_their_limits(points, dwell, repeat):
    y, x, z, phi, theta = zip(*points, strict=True)
    parameters = WaypointParameters(y=y, x=x, z=z, phi=phi, theta=theta, dwell=dwell, repeat=repeat)
    path = Waypoints(dataclasses.replace(ReferenceParameters(), waypoints=parameters))
    time = np.arange(round(path.length / SAMPLE) + 1) * SAMPLE
    found = path.evaluate(time)
    rests = ~(found.velocity.any(axis=1) | found.acceleration.any(axis=1))
    for point in points:
        assert np.abs(found.position[rests] - np.array(point)).max(axis=1).min() < 1e-15
    velocity, acceleration = np.array(parameters.velocity), np.array(parameters.acceleration)
    assert (np.abs(found.velocity) <= velocity * (1.0 + 1e-9)).all()
    assert (np.abs(found.acceleration) <= acceleration * (1.0 + 1e-9)).all()
    visited = [*points, points[0]] if repeat and points[0] != points[-1] else points
    moves = itertools.pairwise(visited)
    shortest = sum(
        max(
            minimum_jerk_time(b - a, v, acc)
            for a, b, v, acc in zip(*move, velocity, acceleration, strict=True)
        )
        for move in moves
    )
    rest = round(dwell / SAMPLE) * SAMPLE * max(1, len(visited) - 1)
    assert shortest + rest <= path.length + 1e-9
    assert path.length <= shortest + rest + SAMPLE * (len(visited) + 1)
    assert_derivatives(path, grid(0.0, path.length) + 3e-5)
    beyond = path.evaluate(np.array([-0.3, path.length + 0.3]))
    if repeat:
        inside = path.evaluate(np.array([path.length - 0.3, 0.3]) % path.length)
        assert beyond.position == pytest.approx(inside.position, abs=1e-9)
    else:
        assert beyond.position == pytest.approx(np.array([points[0], points[-1]]), abs=1e-15)
        assert not beyond.velocity.any()


def test_waypoints_need_all_outputs():
    with pytest.raises(ParameterError, match="'y' 2, 'x' 1"):
        WaypointParameters(x=(0.0,))


@pytest.mark.parametrize(
    ('lines', 'period'),
    [
        ({'x': [3.0], 'z': [3.0]}, 2.0 * math.pi / 3.0),
        ({'x': [3.0, 4.5], 'z': [6.0]}, 2.0 * math.pi / 1.5),
        ({'x': [3.0, 3.0 * math.sqrt(2.0)]}, None),
        ({}, None),
    ],
)
def test_the_period_of_a_sum_is_found(lines, period):
    overrides = {}
    for axis, frequencies in lines.items():
        overrides[f'sinusoids.{axis}.frequency'] = frequencies
        overrides[f'sinusoids.{axis}.amplitude'] = [0.001] * len(frequencies)
        overrides[f'sinusoids.{axis}.phase'] = [0.0] * len(frequencies)
    found = course(build(ReferenceParameters, overrides)).period
    assert found == (period if period is None else pytest.approx(period))
