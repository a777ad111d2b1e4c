"""Who stands at the machine while it is commissioned: a person, or the emulated boards' own."""

from __future__ import annotations

import contextlib
import enum
import math
import os
import select
import sys
import termios
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.signal_parameters import PHASE_NAMES

SHIM = 1e-3
"""By how much shims raise the platen, not so far that it is lifted by its magnets [m]."""

_A_CURRENT = 0.1  # that shows at a load [A]
_BESIDE = 5e-3  # from what looks alike in opposite motors a quarter of the way to the next [m]
Meanwhile = Callable[[], None]


class Act(enum.Enum):
    """What is asked of the operator."""

    LOADS = (
        'disconnect the motors and connect dummy loads instead, of which those named above show '
        'their current (a lamp, a meter)'
    )
    MOTORS = 'disconnect loads and ammeter and connect the motors again'
    PRESS = 'press the emergency stop'
    RELEASE = 'release the emergency stop'
    UNPLUG = "pull the plug of the emergency stop's wire, as if it were broken"
    PLUG = 'put the plug back'
    SHIMS = (
        f'raise the platen by {SHIM * 1e3:g} mm, by a shim of that on each seat of its lower stop'
    )
    NO_SHIMS = 'take the shims away, so that it rests on its lower stop again'
    X_END = 'push it along X, still on its stop, to one end of its guide'
    X_OTHER_END = 'push it to the other end along X'
    Z_END = 'push it along Z, still on its stop, to one end of its guide'
    Z_OTHER_END = 'push it to the other end along Z'
    MIDDLE = (
        'put the platen near the middle, still on its stop, where it can move 20 mm along X and Z'
    )
    BESIDE = 'put it some 5 mm beside the middle along X and along Z, still on its stop'
    BETWEEN = 'put it half as far beside the middle along X and along Z, still on its stop'


class Operator(Protocol):
    """Answers and acts."""

    def go_on(self, step: str) -> None:
        """Agree to a step, or raise StoppedError."""
        ...

    def act(self, what: Act) -> None:
        """Return when it is done."""
        ...

    def act_soon(self, what: Act) -> None:
        """Be told to do it within the next seconds; returns at once."""
        ...

    def sees_current(self, phase: int, meanwhile: Meanwhile | None = None) -> bool:
        """Whether the load of a phase (0 to 11) carries current now.

        ``meanwhile`` is called again and again until the answer is there.
        """
        ...

    def connect_meter(self, phase: int) -> None:
        """Return when an ammeter shows what the load of a phase (0 to 11) carries."""
        ...

    def reads_current(self, phase: int, meanwhile: Meanwhile) -> float:
        """What that ammeter shows now [A]; ``meanwhile`` as in :meth:`sees_current`."""
        ...

    def sees_enabled(self) -> bool:
        """Whether the amplifiers show that they are enabled now."""
        ...

    def wait(self, seconds: float) -> float:
        """Let time pass on the boards; how much has passed [s]."""
        ...


class StoppedError(Exception):
    """The operator does not want to go on."""


class Person:
    """Somebody at the terminal; ``yes``: agrees to every step without being asked."""

    def __init__(self, yes: bool = False) -> None:
        self._yes = yes

    def go_on(self, step: str) -> None:
        """See the protocol."""
        print(f'\n{step}', flush=True)
        if not self._yes and not _agreed('  go on? [y/N] '):
            raise StoppedError

    def act(self, what: Act) -> None:
        """See the protocol."""
        _answer(f'  {what.value}, then press Enter: ')

    def act_soon(self, what: Act) -> None:
        """See the protocol."""
        print(f'  {what.value} NOW', flush=True)

    def sees_current(self, phase: int, meanwhile: Meanwhile | None = None) -> bool:
        """See the protocol."""
        return _seen(f'does the load at {PHASE_NAMES[phase]} carry current now?', meanwhile)

    def connect_meter(self, phase: int) -> None:
        """See the protocol."""
        _answer(f'  connect the ammeter to the load at {PHASE_NAMES[phase]}, then press Enter: ')

    def reads_current(self, phase: int, meanwhile: Meanwhile) -> float:
        """See the protocol."""
        return _number(f'what does the ammeter at {PHASE_NAMES[phase]} show [A]?', meanwhile)

    def sees_enabled(self) -> bool:
        """See the protocol."""
        return _seen('do the amplifiers show that they are enabled now?')

    def wait(self, seconds: float) -> float:
        """See the protocol."""
        begun = time.monotonic()
        time.sleep(seconds)
        return time.monotonic() - begun


def _seen(question: str, meanwhile: Meanwhile | None = None) -> bool:
    """The answer; only a clear no is one, for that is what mostly passes."""
    answer = ''
    while answer not in ('y', 'yes', 'n', 'no'):
        answer = _answer(f'  {question} [y/n] ', meanwhile).strip().lower()
    return answer in ('y', 'yes')


def _number(question: str, meanwhile: Meanwhile) -> float:
    """The answer, asked for until it is a finite number."""
    number = math.nan
    while not math.isfinite(number):
        with contextlib.suppress(ValueError):
            number = float(_answer(f'  {question} ', meanwhile))
    return number


def _agreed(question: str) -> bool:
    return _answer(question).strip().lower() in ('y', 'yes')


def _answer(question: str, meanwhile: Meanwhile | None = None) -> str:
    """What is typed from now on; ``meanwhile`` as for seeing a current. Raises EOFError."""
    if sys.stdin is None:  # closed by whoever started it
        raise EOFError
    if sys.stdin.isatty():
        termios.tcflush(sys.stdin, termios.TCIFLUSH)
        if meanwhile is None:
            return input(question)
    print(question, end='', flush=True)
    return _line(sys.stdin.fileno(), meanwhile)


def _line(stream: int, meanwhile: Meanwhile | None) -> str:
    """The next line, and nothing beyond it. Raises EOFError.

    Python's own reader takes all of a pipe at once, and what it has taken no ``select`` sees: the
    next answer would be waited for while it is there.
    """
    line = b''
    while not line.endswith(b'\n'):
        while meanwhile is not None and not select.select([stream], [], [], 0.0)[0]:
            meanwhile()
        sign = os.read(stream, 1)
        if not sign:
            raise EOFError
        line += sign
    return line.decode(errors='replace')


class EmulatedPerson:
    """Acts on emulated boards, and sees what is true of them.

    ``response``: how long it takes to answer [s].
    """

    def __init__(
        self, boards: EmulatedBoards, go_on: Callable[[str], None], response: float = 0.05
    ) -> None:
        self._boards, self._response = boards, response
        self.go_on = go_on

    def act(self, what: Act) -> None:
        """See the protocol."""
        boards = self._boards
        if what in (Act.LOADS, Act.MOTORS):
            boards.dummy_loads = what is Act.LOADS
        elif what in (Act.PRESS, Act.RELEASE):
            boards.stop_pressed = what is Act.PRESS
        elif what in (Act.UNPLUG, Act.PLUG):
            boards.lines.stop_plugged = what is Act.PLUG
        else:
            self._move(what)

    def _move(self, what: Act) -> None:
        """Move the platen by hand."""
        machine, position = self._boards.parameters.machine, self._boards.rig.state[::2]
        position[:3] = {
            Act.SHIMS: (machine.gap_max - SHIM, *position[1:3]),
            Act.NO_SHIMS: (machine.gap_max, *position[1:3]),
            Act.X_END: (position[0], -machine.x_max, position[2]),
            Act.X_OTHER_END: (position[0], machine.x_max, position[2]),
            Act.Z_END: (*position[:2], -machine.z_max),
            Act.Z_OTHER_END: (*position[:2], machine.z_max),
            Act.MIDDLE: (position[0], 0.0, 0.0),
            Act.BESIDE: (position[0], _BESIDE, _BESIDE),
            Act.BETWEEN: (position[0], 0.5 * _BESIDE, 0.5 * _BESIDE),
        }[what]
        self._boards.place(position)

    def act_soon(self, what: Act) -> None:
        """See the protocol."""
        self.act(what)

    def sees_current(self, phase: int, meanwhile: Meanwhile | None = None) -> bool:
        """See the protocol."""
        self._look(meanwhile)
        return bool(np.abs(self._boards.rig.phase_current[phase]) > _A_CURRENT)

    def _look(self, meanwhile: Meanwhile | None) -> None:
        """Take the time it takes to answer."""
        if meanwhile is None:
            self.wait(self._response)
        else:
            for _ in range(round(self._response / self._boards.period)):
                meanwhile()

    def connect_meter(self, phase: int) -> None:
        """See the protocol."""

    def reads_current(self, phase: int, meanwhile: Meanwhile) -> float:
        """See the protocol."""
        self._look(meanwhile)
        return float(self._boards.rig.phase_current[phase])

    def sees_enabled(self) -> bool:
        """See the protocol."""
        self.wait(self._response)
        return self._boards.lines.enabled

    def wait(self, seconds: float) -> float:
        """See the protocol."""
        begun = self._boards.now()
        self._boards.sleep(seconds)
        return self._boards.now() - begun
