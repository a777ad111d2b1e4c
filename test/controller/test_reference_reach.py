"""What reference a controller does not follow, whoever sends it, and what it does then."""

from __future__ import annotations

import numpy as np
import pytest
from supervised import HOVER, QUICK, STOP, Flight

from maglev_controller.parameters import ControllerParameters
from maglev_controller.reference_reach import ReferenceReach
from maglev_controller.supervision import Supervisor
from maglev_model.axes import AXES
from maglev_model.controller_watch import Status
from maglev_model.modes import Mode
from maglev_model.parameters import build
from maglev_model.phases import Phase

PARAMETERS = ControllerParameters()
LOWER = np.array(PARAMETERS.machine.lower_limit)
UPPER = np.array(PARAMETERS.machine.upper_limit)
REACH = ReferenceReach(PARAMETERS)
STILL = np.zeros(5)


def at(*position: float) -> str:
    return REACH.fault(np.array(position), STILL, STILL)


def test_a_reference_out_of_reach_is_named() -> None:
    """Beyond the stops by more than the margin."""
    assert at(0.031, 0.05, -0.05, 0.003, -0.014) == ''
    assert 'x is 0.06 m' in at(0.025, 0.06, 0.0, 0.0, 0.0)
    assert 'y is 25 m' in at(25.0, 0.0, 0.0, 0.0, 0.0)
    assert 'theta is not finite' in at(0.025, 0.0, 0.0, 0.0, np.nan)


@pytest.mark.parametrize('axis', range(5))
def test_a_reference_may_stand_beyond_a_stop_by_the_margin_and_no_more(axis: int) -> None:
    """Of the tilts: by what it is at the motors."""
    margin = PARAMETERS.measurement.margin
    slack = margin if axis < 3 else margin / PARAMETERS.machine.radius
    for stop, way_out in ((UPPER, 1.0), (LOWER, -1.0)):
        position = HOVER.copy()
        position[axis] = stop[axis] + way_out * 0.999 * slack
        assert at(*position) == ''
        position[axis] += way_out * 0.01 * slack
        assert f'the reference of {AXES[axis]} is' in at(*position)


@pytest.mark.parametrize('axis', range(5))
@pytest.mark.parametrize(
    ('value', 'why'), [(np.nan, 'is not finite'), (-np.inf, 'is not finite'), (1e7, 'moves beyond')]
)
def test_so_are_its_derivatives(axis: int, value: float, why: str) -> None:
    wild = STILL.copy()
    wild[axis] = value
    for derivatives in ((wild, STILL), (STILL, wild)):
        assert f'{AXES[axis]} {why}' in REACH.fault(HOVER, *derivatives)


@pytest.mark.parametrize(('axis', 'value'), [(0, 0.01), (0, 0.034), (1, np.nan), (4, 0.1)])
def test_it_is_landed_from_where_the_last_was_that_could_be_followed(
    axis: int, value: float
) -> None:
    flight = Flight(Supervisor(build(ControllerParameters, QUICK)))
    supervisor = flight.supervisor
    flight.step(Phase.REST, STOP, 0.031)
    assert flight.step(Phase.LIFT_OFF, HOVER, 0.025) == Mode.REGULATING
    wrong = HOVER.copy()
    wrong[axis] = value
    assert flight.step(Phase.TRACK, wrong, 0.025) == Mode.LANDING
    assert f'the reference of {AXES[axis]} is' in supervisor.reason
    assert supervisor.status == Status.FLYING
    assert supervisor.direct_current.all()
    assert supervisor._landing is not None
    np.testing.assert_allclose(supervisor._landing.step()[0][1:], 0.0, atol=1e-12)
    while supervisor.flying:
        flight.step(Phase.TRACK, wrong, 0.031)
    assert supervisor.mode == Mode.FAULT
    assert supervisor.reset_fault()[0]


def test_it_is_not_lifted_off_to() -> None:
    flight = Flight(Supervisor(build(ControllerParameters, QUICK)))
    for _ in range(2):  # also where a flight was before
        flight.step(Phase.REST, STOP, 0.031)
        wrong = STOP + 1e-2
        assert flight.step(Phase.LIFT_OFF, wrong, 0.031) == Mode.FAULT
        assert 'the reference of y is 0.041 m' in flight.supervisor.reason
        assert not flight.supervisor.direct_current.any()
        assert flight.supervisor.status == Status.RESTING
        flight.supervisor.reset_fault()
        flight.supervisor.enable()
        flight.step(Phase.REST, STOP, 0.031)
        assert flight.step(Phase.LIFT_OFF, HOVER, 0.031) == Mode.REGULATING
        flight.supervisor.disable()
        while flight.supervisor.flying:
            flight.step(Phase.REST, STOP, 0.031)
        flight.supervisor.enable()
