"""The currents a reference takes, checked by giving them to the plant's equations of motion."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from maglev_model.machine import MachineParameters as PlantMachine
from maglev_model.machine import machine_constants
from maglev_model.motor import force_coefficients
from maglev_model.parameters import ParameterError, build
from maglev_model.platen import accelerations
from maglev_plant.parameters import PlantParameters
from maglev_reference.check import UnreachableError
from maglev_reference.currents import check_currents, current_use, friction, motor_currents
from maglev_reference.model_parameters import MachineParameters
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.profiles import Kinematics
from maglev_reference.timeline import Timeline

MACHINE = machine_constants(PlantMachine())
RADIUS = 0.397
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
@settings(max_examples=60, deadline=None)
def test_the_plant_accelerates_as_wanted(position, acceleration):
    found = motor_currents(
        samples(position, np.zeros(5), acceleration), MachineParameters(), RADIUS
    )
    state = np.zeros(10)
    state[::2] = position
    out = np.empty(5)
    accelerations(MACHINE, state, found.direct[0], found.quadrature[0], out)
    assert out == pytest.approx(acceleration, abs=0.15)  # by the table of forces, 0.3 %


def test_the_forces_are_the_plants():
    table = MachineParameters()
    for gap, *listed in zip(
        table.gap, table.attraction, table.attraction_current, table.thrust, strict=True
    ):
        k_1, _, k_3, k_h = force_coefficients(MACHINE, gap)
        assert listed == pytest.approx([k_1, k_3, k_h], rel=1e-4)
    plant = PlantParameters()
    assert table.mass == (plant.machine.mass_y, plant.machine.mass_x, plant.machine.mass_z)
    assert table.inertia == plant.machine.inertia
    assert table.gravity == plant.machine.gravity
    assert table.spring == (plant.machine.spring_phi, plant.machine.spring_theta)
    assert table.coulomb == plant.guide.coulomb
    assert table.viscous == plant.guide.viscous


def test_friction_opposes_motion():
    velocity = np.array([[0.1, -0.1, 0.0, 0.05, -0.05]])
    found = friction(velocity, MachineParameters())
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
    assert current_use(moving, ReferenceParameters()) > 1.0
    with pytest.raises(UnreachableError, match=rf'{words} at 3\.005 s .* within 6 A'):
        check_currents(moving, 3.0, 1e-3, ReferenceParameters())


def test_a_trajectory_that_takes_too_much_is_refused_before_it_starts():
    table = {'trajectory': 'circle', 'circle.radius': 0.02, 'circle.frequency': 20.0}
    Timeline(build(ReferenceParameters, {**table, 'duration': 1.0}))
    with pytest.raises(ParameterError, match=r'(x|z) needs 2\.\d* A in motor \d at \d+\.\d\d\d s'):
        Timeline(build(ReferenceParameters, {**table, 'duration': 1.0, 'limits.current': 2.0}))


@pytest.mark.parametrize(
    ('overrides', 'words'),
    [
        ({'machine.gap': [0.02, 0.03]}, "'gap' 2, 'attraction' 6"),
        ({'machine.gap': [0.018, 0.021, 0.02, 0.027, 0.03, 0.033]}, 'must rise'),
    ],
)
def test_a_wrong_machine_is_refused(overrides, words):
    with pytest.raises(ParameterError, match=words):
        build(ReferenceParameters, overrides)
