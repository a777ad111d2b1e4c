"""The currents a reference takes, checked by giving them to the plant's equations of motion."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from maglev_model.guide import GuideParameters
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.parameters import ParameterError, build, from_yaml
from maglev_model.platen import output_accelerations
from maglev_reference.check import UnreachableError
from maglev_reference.currents import (
    check_currents,
    current_amplitudes,
    current_utilisation,
    friction,
    motor_currents,
)
from maglev_reference.motion import Kinematics
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline

PARAMS = Path(__file__).resolve().parents[2] / 'params'
MACHINE = machine_constants(MachineParameters())
HOME = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


def samples(position, velocity, acceleration):
    return Kinematics(*(np.array([row], dtype=float) for row in (position, velocity, acceleration)))


@given(
    st.tuples(
        st.floats(0.0235, 0.029),
        st.floats(-0.05, 0.05),
        st.floats(-0.05, 0.05),
        st.floats(-0.002, 0.002),
        st.floats(-0.006, 0.006),
    ),
    st.tuples(
        st.floats(-4.0, 4.0),
        st.floats(-5.0, 5.0),
        st.floats(-5.0, 5.0),
        st.floats(-4.0, 4.0),
        st.floats(-10.0, 10.0),
    ),
)
@settings(max_examples=60)
def test_the_plant_accelerates_as_wanted(position, acceleration):
    velocity = np.array([0.1, -0.2, 0.0, 0.05, -0.05])
    direct, quadrature, possible = motor_currents(
        samples(position, velocity, acceleration), ReferenceParameters()
    )
    assume(possible.all())
    y, _, _, phi, theta = position
    out = np.array(output_accelerations(MACHINE, y, phi, theta, direct[0], quadrature[0]))
    assert out - friction(velocity, GuideParameters()) == pytest.approx(acceleration, abs=1e-8)


def test_friction_opposes_motion():
    velocity = np.array([[0.1, -0.1, 0.0, 0.05, -0.05]])
    found = friction(velocity, GuideParameters())
    assert found == pytest.approx(
        np.array([[0.303 + 0.05, -0.171 - 0.05, 0.0, 1.32 + 0.025, -1.32 - 0.025]]), abs=1e-12
    )


@pytest.mark.parametrize(
    ('axis', 'acceleration', 'words'),
    [
        (1, 30.0, 'x needs more attraction than there is'),
        (2, -36.0, 'z needs more attraction than there is'),
        (3, 60.0, 'phi needs more attraction than there is'),
        (4, -60.0, 'theta needs more attraction than there is'),
        (0, 12.0, 'y needs more attraction than there is'),
        (0, -300.0, r'y needs 6.8\d A in motor 1'),
    ],
)
def test_who_asks_too_much_is_named_with_the_time(axis, acceleration, words):
    wanted = np.zeros((8, 5))
    wanted[5, axis] = acceleration
    moving = Kinematics(np.tile(HOME, (8, 1)), np.zeros((8, 5)), wanted)
    assert current_utilisation(moving, ReferenceParameters()) > 1.0
    with pytest.raises(UnreachableError, match=rf'{words} at 3\.005 s .* within 6 A'):
        check_currents(moving, 3.0, ReferenceParameters())


def test_a_trajectory_that_takes_too_much_is_refused_before_it_starts():
    table = {'trajectory': 'circle', 'circle.radius': 0.02, 'circle.frequency': 20.0}
    Timeline(build(ReferenceParameters, {**table, 'duration': 1.0}))
    with pytest.raises(ParameterError, match=r'(x|z) needs 2\.\d* A in motor \d at \d+\.\d\d\d s'):
        Timeline(build(ReferenceParameters, {**table, 'duration': 1.0, 'limits.current': 2.0}))


def test_beyond_the_stops_currents_are_those_at_the_stop():
    below, at = np.tile(HOME, (2, 1))
    below[0], at[0] = 0.0, 0.018
    found = [
        current_utilisation(samples(position, np.zeros(5), np.zeros(5)), ReferenceParameters())
        for position in (below, at)
    ]
    assert found[0] == found[1] > 0.0


def test_it_is_checked_with_the_machine_that_is_given():
    single = from_yaml(ReferenceParameters, 'reference', PARAMS / 'single_motor.yaml')
    moving = samples(HOME, np.zeros(5), [-4.0, 3.0, 0.0, 0.0, 0.0])
    amplitude = current_amplitudes(moving, single)[0]
    assert not amplitude[[0, 2, 3]].any()
    assert amplitude[1] == pytest.approx(
        current_amplitudes(moving, ReferenceParameters())[0, 1], rel=1e-12
    )
    table = {'trajectory': 'hold', 'duration': 1.0}
    Timeline(build(ReferenceParameters, table))
    heavy = {'machine.mass_y': 200.0}
    with pytest.raises(ParameterError, match=r'y needs 6\.46 A in motor 1'):
        Timeline(build(ReferenceParameters, {**table, **heavy}))
