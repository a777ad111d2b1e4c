"""Flights of the bridge on emulated boards, with the stage's real regulator or a made-up one."""

from __future__ import annotations

import contextlib
import functools
import math
from collections.abc import Callable

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import StageError
from maglev_model.parameters import build
from maglev_study.references import ellipse_at

HOME = {'homing.at_start': True, 'homing.x': 0.0, 'homing.z': 0.0}
OMEGA = 1.5 * math.pi
Target = Callable[[float], tuple[np.ndarray, np.ndarray, np.ndarray]]


def ellipse(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The paper's ellipse in 4DOF: position, velocity, acceleration, (5,) each."""
    return ellipse_at(OMEGA * time, 0.01)


def hover(*position: float) -> Target:
    """Stay at y, x, z, phi, theta; what is left out is 0."""
    place = np.zeros(5)
    place[: len(position)] = position
    return lambda _time: (place, np.zeros(5), np.zeros(5))


@functools.cache
def _regulator() -> Regulator:
    """Designed once; each flight begins with it at rest."""
    return Regulator(ControllerParameters())


class Flight:
    """A platen in flight along a target from the start on; one :meth:`step` a sample."""

    def __init__(self, target: Target, overrides: dict[str, object] | None = None) -> None:
        parameters = build(BridgeParameters, {**HOME, **(overrides or {})})
        self.boards = EmulatedBoards(parameters)
        self.rig = self.boards.rig
        driver = QuanserDriver(parameters, self.boards, self.boards.now)
        self.stage = BridgeStage(parameters, driver=driver)
        self.regulator = _regulator()
        self.regulator.reset()
        self.target = target
        self.stage.configure()
        position, velocity, _ = target(0.0)
        self.boards.place(position, velocity)
        self.stage.activate()
        self.samples = 0
        self.detected: int | None = None  # samples from the start to the latched fault
        self.highest_current = 0.0
        self._i_d, self._i_q = np.zeros(4), np.zeros(4)

    def step(self, controlled: bool = True) -> None:
        """One sample: read, and the regulator's answer, or none."""
        sample = self.stage.read()
        if controlled:
            try:
                target = self.target(1e-3 * self.samples)
                self.regulator.step(*sample, *target, self._i_d, self._i_q)
            except MeasurementFault:
                self._i_d[:] = self._i_q[:] = 0.0
            self.stage.write(self._i_d, self._i_q)
        else:
            self.stage.hold()
        self.samples += 1

    def run(self, samples: int, controlled: bool = True) -> None:
        """So many samples; ends when the boards are lost."""
        for _ in range(samples):
            with contextlib.suppress(StageError):
                self.step(controlled and self.stage.mode is Mode.FOLLOWING)
            if self.stage.fault is not None and self.detected is None:
                self.detected = self.samples
            if self.stage.mode is Mode.LOST:
                return

    def until_no_current(self, longest: int = 4000) -> None:
        """Go on until the bridge has ended the current, then for a while."""
        for _ in range(longest):
            if self.stage.mode in (Mode.DISABLED, Mode.LOST):
                break
            self.step(False)
        assert self.stage.mode in (Mode.DISABLED, Mode.LOST)
        for _ in range(300):
            if self.stage.mode is Mode.LOST:
                self.boards.tick()
            else:
                self.step(False)

    @property
    def tilt(self) -> float:
        """Greatest true tilt [rad]."""
        return float(np.max(np.abs(self.rig.state[[6, 8]])))
