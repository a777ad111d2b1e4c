"""Flies through all that a controller does and prints what was compiled after it was ready.

The argument is whose law it is: ``own``, or one that answers by ``accelerations`` or ``currents``.
"""

from __future__ import annotations

import sys
import time
import types
from typing import Any

import numpy as np
from compiled_functions import compiled

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_model.parameters import build

STOP, HOVER, STILL = np.array([0.031, 0, 0, 0, 0]), np.array([0.025, 0, 0, 0, 0]), np.zeros(5)


class Mine:
    """A law that fails after some samples."""

    def __init__(self, shape: Any) -> None:
        self.answer = np.zeros(shape)

    def reset(self) -> None:
        self.left = 30

    def step(self, *_: object) -> Any:
        self.left -= 1
        return self.answer if self.left else 'nothing'


def step(sequence: int, phase: Phase, wanted: np.ndarray) -> None:
    """A sample with the platen where it is wanted."""
    supervisor.references.store(sequence, phase, int(phase), wanted, STILL, STILL)
    supervisor.step(supervisor.references.find(sequence), np.full(4, wanted[0]), 0.0, 0.0)


SHAPE = {'accelerations': 5, 'currents': (2, 4)}.get(sys.argv[1])
package, module = types.ModuleType('mine'), types.ModuleType('mine.law')
package.__path__ = []
module.make = lambda _: Mine(SHAPE)  # type: ignore[attr-defined]
sys.modules |= {'mine': package, 'mine.law': module}
given = {} if SHAPE is None else {'law': 'mine.law'}
supervisor = Supervisor(build(ControllerParameters, given))
ready = compiled()
for sequence in range(20):
    phase = (Phase.REST, Phase.LIFT_OFF, Phase.TRACK, Phase.STEP)[sequence // 5]
    step(sequence, phase, STOP if sequence < 5 else HOVER)
assert supervisor.mode == Mode.REGULATING, supervisor.reason
if SHAPE is None:
    design = supervisor.redesign(build(ControllerParameters, {'y.bandwidth': 170.0}))
    while not design.done:
        time.sleep(0.01)
    supervisor.adopt(*design.result())
    step(20, Phase.TRACK, HOVER)
    supervisor.stop('asked for')
for sequence in range(21, 61):
    step(sequence, Phase.TRACK, HOVER)
assert supervisor.mode == Mode.LANDING, supervisor.reason
print(set(compiled(since=ready)) or 'nothing')
