"""What a controller does with a reference that it cannot follow."""

from __future__ import annotations

import numpy as np
import pytest
from supervised import HOVER, QUICK, STOP, Flight

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_model.axes import AXES
from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build


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
