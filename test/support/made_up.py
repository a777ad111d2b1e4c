"""A bridge whose observer says what a test makes up; nothing flies."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from wired import bridge

from maglev_hw_bridge import life_cycle
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.stage import BridgeStage

LOWER_STOP = 0.031


def active(**overrides: object) -> tuple[BridgeStage, EmulatedBoards]:
    stage, boards = bridge(**overrides)
    stage.configure()
    stage.activate()
    return stage, boards


def watched(stage: BridgeStage, y: float = 0.025, rate: float = 0.0) -> None:
    """Have the observer say so, with all gaps at ``y``."""
    state = stage.guard.arrays
    state.samples = 200
    state.position[:] = state.rate[:] = state.disturbance[:] = 0.0
    state.position[0], state.rate[0] = y, rate
    state.believed[:4] = state.length[:4] = y


def aloft(stage: BridgeStage) -> None:
    """In flight, as far as the bridge knows."""
    watched(stage)
    stage.flying = True


def volts(boards: EmulatedBoards) -> list[float]:
    """At the outputs of the twelve phases."""
    out: list[float] = boards.volts[[0] * 6 + [1] * 6, [*range(6), *range(6)]].tolist()
    return out


def refusing(error: Exception) -> Callable[..., None]:
    """What raises it, however it is called."""

    def refuse(*_: object) -> None:
        raise error

    return refuse


class Calls:
    """What was asked of something that stands in."""

    def __init__(self, answer: object = None) -> None:
        self.answer, self.given = answer, []  # type: ignore[var-annotated]

    def __call__(self, *given: object) -> object:
        self.given.append(given)
        return self.answer


class Clock:
    """A time and sleeps that only a test lets pass."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        self.slept: list[float] = []
        monkeypatch.setattr(life_cycle, 'time', self)

    def monotonic(self) -> float:
        return self.now

    def sleep(self, duration: float) -> None:
        self.slept.append(duration)
