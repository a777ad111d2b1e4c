"""Whether the controller followed the reference for as long as that flew. No ROS here."""

from __future__ import annotations

from typing import Any

import numpy as np

from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import phase_name
from maglev_monitor.metrics.decoding import Records

_BY_ITSELF = (Mode.LANDING, Mode.FAULT)


class Following:
    """Where the controller first landed by itself, or was in a fault, in a run."""

    def __init__(self) -> None:
        self.left: dict[str, Any] | None = None
        """``sample``, ``phase`` and ``mode`` there, None where it flew the run to its end."""

    def add(self, rows: Records, phases: np.ndarray[Any, np.dtype[np.uint8]]) -> None:
        """Take the run's next rows (n,) and what phase each is in, in the end the first of END.

        That one may lie where the controller landed: a reference that was stopped tells it late.
        """
        lost = np.flatnonzero(rows['has_controller'] & np.isin(rows['mode'], _BY_ITSELF))
        if self.left is None and len(lost):
            first = int(lost[0])
            self.left = {
                'sample': int(rows['sequence'][first]),
                'phase': phase_name(int(phases[first])),
                'mode': Mode(rows['mode'][first]).name,
            }
