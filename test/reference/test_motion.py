"""Motions: the quintic against SciPy's Hermite interpolation, and its peaks."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.interpolate import BPoly

from maglev_model.quintic import PEAK_ACCELERATION, PEAK_VELOCITY
from maglev_reference.motion import Quintic, Stand, State, state_at

vectors = hnp.arrays(float, 5, elements=st.floats(-1.0, 1.0, width=32))


@given(
    st.tuples(vectors, vectors, vectors),
    st.tuples(vectors, vectors, vectors),
    st.floats(0.05, 5.0),
)
@settings(max_examples=40)
def test_quintic_is_the_hermite_polynomial(start, end, duration):
    quintic = Quintic(State(*start), State(*end), duration)
    time = np.linspace(0.0, duration, 23)
    found = quintic.evaluate(time)
    for axis in range(5):
        expected = BPoly.from_derivatives(
            [0.0, duration], [[v[axis] for v in start], [v[axis] for v in end]]
        )
        for order, values in enumerate(found):
            scale = 30.0 * max(1.0, duration**2) / duration**order
            assert values[:, axis] == pytest.approx(
                expected.derivative(order)(time) if order else expected(time), abs=1e-12 * scale
            )


def test_quintic_keeps_its_end_state_exactly():
    end = np.array([0.0271, 0.013, -0.03, 0.001, 0.0099])
    quintic = Quintic(State.at_rest(np.full(5, 0.1)), State.at_rest(end), 0.2)
    found = quintic.evaluate(np.array([0.2, 0.2001, 7.0]))
    assert (found.position == end).all()
    assert not found.velocity.any()
    assert not found.acceleration.any()


def test_quintic_needs_time():
    with pytest.raises(ValueError, match='positive time'):
        Quintic(State.at_rest(np.zeros(5)), State.at_rest(np.ones(5)), 0.0)


@given(st.floats(0.001, 0.1), st.floats(0.05, 5.0))
@settings(max_examples=30)
def test_peaks_of_the_minimum_jerk_move(distance, duration):
    end = np.array([-distance, distance, 0.0, 0.0, 0.0])
    quintic = Quintic(State.at_rest(np.zeros(5)), State.at_rest(end), duration)
    time = np.linspace(0.0, duration, 4001)
    found = quintic.evaluate(time)
    velocity = PEAK_VELOCITY * distance / duration
    acceleration = PEAK_ACCELERATION * distance / duration**2
    jerk = 60.0 * distance / duration**3
    for axis in (0, 1):
        assert np.abs(found.velocity[:, axis]).max() == pytest.approx(velocity, rel=1e-6)
        assert np.abs(found.acceleration[:, axis]).max() == pytest.approx(acceleration, rel=1e-6)
    steepest = np.abs(np.diff(found.acceleration[:-1, 1]) / time[1]).max()
    assert steepest == pytest.approx(jerk, rel=2e-3)
    assert (np.diff(found.position[:, 1]) >= 0.0).all()


def test_stand_stands():
    state = state_at(Stand(np.arange(5.0)), 3.0)
    assert state.position.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert not state.velocity.any()
    assert not state.acceleration.any()
