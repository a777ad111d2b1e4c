"""A supervisor that is led sample by sample, and references for it."""

from __future__ import annotations

import numpy as np

from maglev_controller.supervision import Supervisor
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase

STOP = np.array([0.031, 0.0, 0.0, 0.0, 0.0])
HOVER = np.array([0.025, 0.0, 0.0, 0.0, 0.0])

STANDING = {'following.error': (1.0,) * 5}
"""For a platen that stands where the test says, whatever the reference wants."""

QUICK = STANDING | {
    'landing.braking_time': 0.05,
    'landing.descent_time': 0.1,
    'landing.settle_time': 0.01,
}


def lead(
    supervisor: Supervisor,
    sequence: int,
    phase: Phase,
    wanted: np.ndarray,
    gap: float,
    x: float = 0.0,
    segment: int = 0,
) -> Mode:
    """The mode after a sample with the platen level at ``gap`` and ``x``."""
    references = supervisor.references
    references.store(sequence, phase, segment, wanted, np.zeros(5), np.zeros(5))
    supervisor.step(references.find(sequence), np.full(4, gap), x, 0.0)
    return supervisor.mode


class Flight:
    """Samples one after another, each with its reference."""

    def __init__(self, supervisor: Supervisor) -> None:
        self.supervisor = supervisor
        self.sequence = -1

    def step(
        self, phase: Phase, wanted: np.ndarray, gap: float, x: float = 0.0, segment: int = 0
    ) -> Mode:
        """The mode after a sample with the platen level at ``gap`` and ``x``."""
        self.sequence += 1
        return lead(self.supervisor, self.sequence, phase, wanted, gap, x, segment)
