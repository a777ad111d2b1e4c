"""A small lift-off under supervision: up from the stop, a moment in the air, and down again.

On the upper stop the same currents press the platen against it, and nothing moves: that is how the
two stops are told apart.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from maglev_hw_bridge.landing import LEAST_ATTRACTION
from maglev_hw_bridge.mode import Mode
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.axes import FloatArray
from maglev_model.inverse import CurrentLimits, exact_currents
from maglev_model.machine import machine_constants

_RISE, _HOVER = 0.5, 0.5  # [s]

TILT = 5e-4
"""More tilt than this in a lift is wrong [rad]."""


class Lift:
    """One lift; afterwards :attr:`risen` and :attr:`tilt` tell what was seen of it."""

    def __init__(self, parameters: BridgeParameters, height: float) -> None:
        """``height`` [m] from where the platen rests."""
        landing = parameters.landing
        self.height = height
        self.risen = 0.0  # mean while it was to hover [m]
        self.tilt = 0.0  # greatest then [rad]
        self._period = parameters.sample_time
        self._stiffness, self._damping = np.array(landing.stiffness), np.array(landing.damping)
        self._machine = machine_constants(parameters.machine)
        self._limits = CurrentLimits(landing.current, 1.0, LEAST_ATTRACTION)
        rest = np.array([parameters.machine.gap_max, 0.0, 0.0, 0.0, 0.0])
        self._currents(rest, np.zeros(5))  # compiled before the boards wait for it

    def _currents(self, position: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
        i_d, i_q, _ = exact_currents(self._machine, position[None], wanted[None], self._limits)
        return i_d[0], i_q[0]

    @property
    def fine(self) -> bool:
        """Whether the platen rose as it was to."""
        return 0.5 * self.height < self.risen < 1.5 * self.height and self.tilt <= TILT

    def fly(self, stage: Any) -> None:
        """Lift the platen of an active bridge and land; ends early when a fault does.

        Raises StageError when the boards are lost, ValueError for currents that are refused.
        """
        watched = stage.guard.arrays
        stage.read()
        stage.hold()
        stage.read()
        target = watched.position.copy()
        start = target[0]
        target[3:] = 0.0
        heights = []
        for n in range(round((_RISE + _HOVER) / self._period)):
            way = min(n * self._period / _RISE, 1.0)
            target[0] = start - self.height * way**2 * (3.0 - 2.0 * way)
            error = target - watched.position
            wanted = self._stiffness * error - self._damping * watched.rate
            stage.write(*self._currents(watched.position, wanted))
            stage.read()
            if way >= 1.0:
                heights.append(start - watched.position[0])
                self.tilt = max(self.tilt, float(np.max(np.abs(watched.position[3:]))))
            if stage.mode is not Mode.FOLLOWING:
                break
        stage.land('lifted')
        while stage.flying:
            stage.hold()
            stage.read()
        self.risen = float(np.mean(heights)) if heights else 0.0
