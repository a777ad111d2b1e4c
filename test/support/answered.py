"""What an inverse answers, and what the plant's own equations make of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from hypothesis import strategies as st

from maglev_model.inverse import Answer, CurrentLimits
from maglev_model.machine import MachineParameters, machine_constants
from maglev_model.platen import output_accelerations

MACHINE = machine_constants(MachineParameters())
ALL = np.ones(5)
WIDE = CurrentLimits(current=1000.0, levitation_first=0.0, least_attraction=0.0)
PRIORITY = CurrentLimits(current=7.0, levitation_first=1.0, least_attraction=0.1)

outputs = st.tuples(
    st.floats(0.0185, 0.0305),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.003, 0.003),
    st.floats(-0.012, 0.012),
).map(np.array)
gentle = st.tuples(
    st.floats(-6.0, 5.0),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.floats(-4.0, 4.0),
    st.floats(-4.0, 4.0),
).map(np.array)
rough = st.lists(st.floats(-2e3, 2e3), min_size=5, max_size=5).map(np.array)


class Answered:
    """What an inverse gives for one wanted acceleration."""

    def __init__(
        self,
        inverse: Callable[..., int],
        limits: CurrentLimits,
        output: np.ndarray,
        wanted: np.ndarray,
        controlled: np.ndarray = ALL,
    ) -> None:
        self.direct, self.quadrature = np.zeros(4), np.zeros(4)
        self.realised, self.excess = np.zeros(5), np.zeros(2)
        answer = Answer(self.direct, self.quadrature, self.realised, self.excess)
        self.limited_by = inverse(MACHINE, limits, controlled, output, wanted, answer)
        y, _, _, phi, theta = output
        self.plant = np.array(
            output_accelerations(MACHINE, y, phi, theta, self.direct, self.quadrature)
        )
