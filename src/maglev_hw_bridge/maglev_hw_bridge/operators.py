"""Who stands at the machine while it is commissioned: a person, or the emulated boards' own."""

from __future__ import annotations

import enum
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from maglev_hw_bridge.drivers.emulated import EmulatedBoards

_A_CURRENT = 0.1  # that shows at a load [A]


class Act(enum.Enum):
    """What is asked of the operator."""

    LOADS = (
        'disconnect the motors and connect dummy loads instead, at motor 1 phase a one that shows '
        'its current (a lamp, a meter)'
    )
    MOTORS = 'disconnect the loads and connect the motors again'
    PRESS = 'press the emergency stop'
    RELEASE = 'release the emergency stop'
    UNPLUG = "pull the plug of the emergency stop's wire, as if it were broken"
    PLUG = 'put the plug back'


class Sight(enum.Enum):
    """What the operator is asked for."""

    CURRENT = 'did the load at motor 1 phase a carry current just now?'
    ENABLED = 'do the amplifiers show that they are enabled now?'


class Operator(Protocol):
    """Answers and acts."""

    look: float
    """Time needed to look at a load [s]."""

    def go_on(self, step: str) -> None:
        """Agree to a step, or raise StoppedError."""
        ...

    def act(self, what: Act) -> None:
        """Return when it is done."""
        ...

    def act_soon(self, what: Act) -> None:
        """Be told to do it within the next seconds; returns at once."""
        ...

    def sees(self, what: Sight) -> bool:
        """Whether it is so."""
        ...

    def wait(self, seconds: float) -> None:
        """Let time pass on the boards."""
        ...


class StoppedError(Exception):
    """The operator does not want to go on."""


class Person:
    """Somebody at the terminal; ``yes``: agrees to every step without being asked."""

    look = 2.0

    def __init__(self, yes: bool = False) -> None:
        self._yes = yes

    def go_on(self, step: str) -> None:
        """See the protocol."""
        print(f'\n{step}', flush=True)
        if not self._yes and not _agreed('  go on? [y/N] '):
            raise StoppedError

    def act(self, what: Act) -> None:
        """See the protocol."""
        input(f'  {what.value}, then press Enter: ')

    def act_soon(self, what: Act) -> None:
        """See the protocol."""
        print(f'  {what.value} NOW', flush=True)

    def sees(self, what: Sight) -> bool:
        """See the protocol."""
        return _agreed(f'  {what.value} [y/N] ')

    def wait(self, seconds: float) -> None:
        """See the protocol."""
        time.sleep(seconds)


def _agreed(question: str) -> bool:
    return input(question).strip().lower() in ('y', 'yes')


class EmulatedPerson:
    """Acts on emulated boards, and sees what is true of them."""

    look = 0.05

    def __init__(self, boards: EmulatedBoards, go_on: Callable[[str], None]) -> None:
        self._boards = boards
        self.go_on = go_on

    def act(self, what: Act) -> None:
        """See the protocol."""
        boards = self._boards
        if what in (Act.LOADS, Act.MOTORS):
            boards.dummy_loads = what is Act.LOADS
        elif what in (Act.PRESS, Act.RELEASE):
            boards.stop_pressed = what is Act.PRESS
        else:
            boards.lines.stop_plugged = what is Act.PLUG

    def act_soon(self, what: Act) -> None:
        """See the protocol."""
        self.act(what)

    def sees(self, what: Sight) -> bool:
        """See the protocol."""
        if what is Sight.ENABLED:
            return self._boards.lines.enabled
        return bool(np.abs(self._boards.rig.phase_current[0]) > _A_CURRENT)

    def wait(self, seconds: float) -> None:
        """See the protocol."""
        self._boards.sleep(seconds)
