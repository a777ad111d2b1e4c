"""What a kind of fault is: how it is drawn, what it does to a flight, what it is judged by."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from maglev_study.faults.flight import Flight
from maglev_study.faults.programme import PHASES

NOMINAL = 0.01
"""A landing that nothing makes harder meets the stop below this [m/s]."""
DEGRADED = 0.05
"""One without an encoder, or with a failing amplifier, below this [m/s]."""
CUT = None
"""The current may be cut: no faster than that was foretold."""
NOTHING = '(?!)'
"""What a reason must match where nothing failed: there must be none."""


@dataclasses.dataclass(frozen=True)
class Fault:
    """One fault: what fails, how much, and how long after the instant of the run."""

    kind: str
    targets: tuple[int, ...] = ()  # encoders, phases, or a board
    size: float = 0.0  # tens of micrometres, milliseconds, share: by kind
    call: str = ''  # of the vendor's module
    delay: int = 0  # [ms]


class Expected(NamedTuple):
    """What must come of a fault."""

    impact: float | None  # greatest [m/s], or CUT
    seen: float | None  # from when it shows to when it is latched [s]; None: need not be
    blame: str  # what the reason must match, or ''
    aloft: bool = False  # seen only where the platen flies when it shows
    stuck: tuple[int, ...] = ()  # encoders that stand still from then on
    encoders: tuple[int, ...] = ()  # those that fail, of which ``blame`` may name any


Begin = Callable[['Run', Fault], object]


class Run(NamedTuple):
    """What a fault acts on: the flight, random numbers, and where it notes when it shows."""

    flight: Flight
    rng: np.random.Generator
    shows: list[int]  # samples at which something could be seen of it


class Kind(NamedTuple):
    """A row of the campaign's table."""

    name: str
    draw: Callable[[np.random.Generator], Fault]
    begin: Begin
    expected: Callable[[Fault], Expected]
    phases: tuple[str, ...] = PHASES
    weight: int = 1
