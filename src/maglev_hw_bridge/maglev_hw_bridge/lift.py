"""A small lift-off under supervision: up from the stop, a moment in the air, and down again.

First short pushes, each harder than the one before, until the encoders show that the platen rises:
that makes up for friction and for what the machine differs in from the model. On the upper stop the
same currents press the platen against it, and nothing moves however much no machine within 10 % of
the model could rest under: that is how the two stops are told apart. Nothing moves for encoders
that are not plugged in either, so no push is longer than what the platen falls back from, and
between them the magnets are weakened: friction would hold it up otherwise, push upon push.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from maglev_hw_bridge.landing import LEAST_ATTRACTION
from maglev_hw_bridge.mode import Mode
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.observer import SUPPORT
from maglev_model.axes import FloatArray, X, Y, Z
from maglev_model.currents import exact_currents
from maglev_model.inverse import CurrentLimits
from maglev_model.machine import machine_constants

_RISE, _HOVER = 0.5, 0.5  # [s]
_INTEGRATION = 20.0  # of the errors of y and the tilts [1/s]
_PUSHES = 23
_PAUSE, _PUSH = 0.09, 0.004  # before and of each [s]; no encoder is judged to be stuck in them
_GROWTH = 100.0  # of the push while it lasts [m/s³]
_NO_PUSH = 2.0  # about what the platen weighs more than its magnets carry there [m/s²]
_DOWN = 4.0  # carries every platen back, and frees none that hangs on the upper stop [m/s²]
_FALL = 1.0 / 3.0  # of the pause, in which most have come back by themselves, more softly
_MOST_PUSH = -7.0  # a platen 10 % heavier, with magnets 10 % weaker, rises at about -4.5 [m/s²]
_MOVED = 1.5e-5  # what has risen by this has left its stop [m]

_TILT = 5e-4  # more is wrong in the air [rad]
_ASKEW, _SOON = 8e-4, 0.01  # what is, or soon will be, so far tilted is pulled [rad], [s]


class Lift:
    """One lift; afterwards :attr:`risen`, :attr:`tilt` and :attr:`rises_at` tell what was seen."""

    def __init__(self, parameters: BridgeParameters, height: float) -> None:
        """``height`` [m] from where the platen rests."""
        landing = parameters.landing
        self.height = height
        self.risen = 0.0  # mean while it was to hover [m]
        self.tilt = 0.0  # greatest then [rad]
        self.rises_at = math.nan  # what the model makes of the currents that moved it up [m/s²]
        self._counted = np.zeros(4, np.bool_)  # gap encoders, since it began
        self._gaps = np.zeros(4)  # read last [m]
        self._asked = 0.0  # of the currents put out last, along y [m/s²]
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
        return 0.5 * self.height < self.risen < 1.5 * self.height and self.tilt <= _TILT

    @property
    def silent(self) -> list[int]:
        """The gap encoders that have not counted once."""
        return [int(i) for i in np.flatnonzero(~self._counted)]

    def fly(self, stage: Any) -> None:
        """Lift the platen of an active bridge and land; ends early when a fault does.

        A platen that does not rise is left at rest; the caller deactivates the bridge.

        Raises StageError when the boards are lost, ValueError for currents that are refused.
        """
        watched = stage.guard.arrays
        stage.read()
        stage.hold()
        self._gaps[:] = stage.read().gap
        rest = float(np.mean(self._gaps))
        target = watched.position.copy()
        start = target[Y]
        target[3:] = 0.0
        push = np.zeros(5)
        push[Y] = self._push(stage, target, rest)
        if math.isnan(push[Y]):
            return  # it still rests, whatever on, and what called ends the current
        integral = _INTEGRATION * self._period * self._stiffness
        integral[[X, Z]] = 0.0  # guides hold the platen there
        heights, pushes = [], []
        for n in range(round((_RISE + _HOVER) / self._period)):
            way = min(n * self._period / _RISE, 1.0)
            target[Y] = start - self.height * way**2 * (3.0 - 2.0 * way)
            push += integral * (target - watched.position)
            if watched.upper[Y] - watched.position[Y] < SUPPORT:  # of an unknown share of it
                stage.guard.settle()
            risen = rest - self._sample(stage, target, push)
            if 0.5 <= way < 1.0:
                pushes.append(self._asked)
            if way >= 1.0:
                heights.append(risen)
                self.tilt = max(self.tilt, float(np.max(np.abs(watched.position[3:]))))
            if stage.mode is not Mode.FOLLOWING:
                break
        stage.land('lifted')
        while stage.flying:
            stage.hold()
            stage.read()
        if heights:
            self.risen, self.rises_at = float(np.mean(heights)), float(np.mean(pushes))

    def _push(self, stage: Any, target: FloatArray, rest: float) -> float:
        """The push under which it rose from ``rest`` [m/s²]; not a number when it did not."""
        watched, push = stage.guard.arrays, np.array([_NO_PUSH, 0.0, 0.0, 0.0, 0.0])
        between = push.copy()
        pause, length = round(_PAUSE / self._period), max(round(_PUSH / self._period), 1)
        for _ in range(_PUSHES):
            for n in range(pause + length):
                stage.guard.settle()
                if n >= pause:
                    push[Y] = max(push[Y] - _GROWTH * self._period, _MOST_PUSH)
                between[Y] = _NO_PUSH if n < _FALL * pause else _DOWN
                target[Y] = watched.position[Y]
                risen = rest - self._sample(stage, target, push if n >= pause else between)
                if risen >= _MOVED or stage.mode is not Mode.FOLLOWING:
                    return float(push[Y])
        return math.nan

    def _sample(self, stage: Any, target: FloatArray, push: FloatArray) -> float:
        """One sample towards ``target`` (5,) with a ``push`` (5,); the mean gap after it [m]."""
        watched = stage.guard.arrays
        error = target - watched.position
        wanted = self._stiffness * error - self._damping * watched.rate + push
        wanted[Y] = self._asked = max(float(wanted[Y]), _MOST_PUSH)
        stage.write(*self._currents(watched.position, wanted))
        gaps = stage.read().gap
        self._counted |= gaps != self._gaps
        self._gaps[:] = gaps
        soon = np.abs(watched.position[3:]) + _SOON * np.abs(watched.rate[3:])
        if stage.mode is Mode.FOLLOWING and np.max(soon) > _ASKEW:
            stage.cut_askew()
        return float(np.mean(gaps))
