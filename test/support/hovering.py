"""A guard that watches a platen at rest in the air."""

from __future__ import annotations

import numpy as np

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import GuardArrays
from maglev_model.inverse import NO_LIMITS, Answer, exact_inverse
from maglev_model.machine import machine_constants
from maglev_model.platen import gaps_from_outputs

PARAMETERS = BridgeParameters()
MACHINE = machine_constants(PARAMETERS.machine)


class Hover:
    """A platen that stays where it is, carried by the currents that it takes."""

    def __init__(
        self, *, phi: float = 0.0, settled: bool = True, parameters: BridgeParameters = PARAMETERS
    ) -> None:
        output = np.array([0.025, 0.0, 0.0, phi, 0.0])
        gap, direct, quadrature = np.empty(4), np.empty(4), np.empty(4)
        gaps_from_outputs(MACHINE, output, gap)
        answer = Answer(direct, quadrature, np.empty(5), np.empty(2))
        exact_inverse(MACHINE, NO_LIMITS, np.ones(5), output, np.zeros(5), answer)
        amplifiers = Amplifiers(parameters)
        amplifiers.drive(direct, quadrature, 0.0, 0.0)
        self.length = np.array([*gap, 0.0, 0.0])
        self.current = amplifiers.arrays.current.copy()
        self.judge = guard.Guard(parameters)
        self.watched = self.judge.arrays
        for _ in range(5):
            assert self.sample() == (guard.FINE, 0)
        if settled:  # at once: there is nothing to find that would disturb it
            self.watched.samples = self.watched.settling

    def sample(self, *, flying: bool = True, behind: int = 0) -> tuple[int, int]:
        """What comes of one more."""
        return self.judge.watch(self.length, self.current, flying, behind)


def hovering() -> GuardArrays:
    """Four gaps at 25 mm, x and z in the middle; nothing counts."""
    watched: GuardArrays = Hover().watched
    watched.believed[:] = watched.length[:] = watched.past[0] = [0.025] * 4 + [0.0] * 2
    watched.rigid = True
    watched.unseen[:] = 0.0
    return watched
