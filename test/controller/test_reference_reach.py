"""What reference a controller does not follow, whoever sends it."""

from __future__ import annotations

import numpy as np
import pytest
from supervised import HOVER

from maglev_controller.parameters import ControllerParameters
from maglev_controller.reference_reach import ReferenceReach
from maglev_controller.step.sample import LARGEST_REFERENCE
from maglev_model.axes import AXES

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


@pytest.mark.parametrize('axis', range(5))
def test_the_bounds_themselves_are_within_reach(axis: int) -> None:
    margin = PARAMETERS.measurement.margin / (1.0 if axis < 3 else PARAMETERS.machine.radius)
    fast = STILL.copy()
    fast[axis] = LARGEST_REFERENCE
    for bound in (LOWER[axis] - margin, UPPER[axis] + margin):
        position = HOVER.copy()
        position[axis] = bound
        assert at(*position) == ''
        assert 'moves beyond any machine' in REACH.fault(position, fast, STILL)
