"""When the regulator acts: what an enable does, and what becomes of a platen that is lost."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_model.modes import Mode
from maglev_model.phases import Phase

STOP = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])


@pytest.fixture
def supervisor() -> Supervisor:
    return Supervisor(ControllerParameters())


class Flight:
    """Samples one after another, each with its reference."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.supervisor = supervisor
        self.sequence = -1

    def step(self, phase: Phase, wanted: np.ndarray, gap: float, x: float = 0.0) -> Mode:
        """The mode after a sample with the platen level at ``gap`` and ``x``."""
        self.sequence += 1
        references = self.supervisor.references
        references.store(self.sequence, phase, 0, wanted, np.zeros(5), np.zeros(5))
        row = references.find(self.sequence)
        self.supervisor.step(row, np.full(4, gap), x, 0.0)
        return self.supervisor.mode


def test_an_enable_waits_for_the_next_lift_off(supervisor: Supervisor) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.REGULATING
    supervisor.cut('emergency stop')
    assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.FAULT
    assert supervisor.reset_fault()[0]
    assert supervisor.enable()[0]
    for _ in range(3):
        assert flight.step(Phase.TRACK, HOVER, 0.031) == Mode.WAITING
        assert not supervisor.direct_current.any()
    assert flight.step(Phase.END, STOP, 0.031) == Mode.WAITING
    assert flight.step(Phase.LIFT_OFF, STOP, 0.031) == Mode.REGULATING


def test_a_landing_cannot_be_called_off(supervisor: Supervisor) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    flight.step(Phase.TRACK, HOVER, 0.025)
    assert supervisor.disable()[0]
    assert not supervisor.enable()[0]
    assert flight.step(Phase.TRACK, HOVER, 0.025) == Mode.LANDING


@pytest.mark.parametrize(
    ('gap', 'x', 'said'),
    [(0.031, 0.0, 'y is at 0.03100 m'), (0.01815, 0.0, 'y is'), (0.025, 0.0499, 'x is at')],
)
def test_a_platen_at_a_stop_and_far_off_is_lost(
    supervisor: Supervisor, gap: float, x: float, said: str
) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, gap)
    for _ in range(400):
        assert flight.step(Phase.TRACK, HOVER, gap, x) == Mode.REGULATING
    assert flight.step(Phase.TRACK, HOVER, 0.0255) == Mode.REGULATING  # which counts anew
    for _ in range(499):
        assert flight.step(Phase.TRACK, HOVER, gap, x) == Mode.REGULATING
    assert flight.step(Phase.TRACK, HOVER, gap, x) == Mode.LANDING
    assert 'the platen is lost' in supervisor.reason
    assert said in supervisor.reason


def test_far_from_every_stop_or_near_the_reference_it_is_not(supervisor: Supervisor) -> None:
    flight = Flight(supervisor)
    flight.step(Phase.REST, STOP, 0.031)
    near = STOP - np.array([0.0009, 0.0, 0.0, 0.0, 0.0])
    for _ in range(700):
        assert flight.step(Phase.LIFT_OFF, near, 0.031) == Mode.REGULATING
    for _ in range(700):
        assert flight.step(Phase.TRACK, HOVER, 0.029) == Mode.REGULATING
