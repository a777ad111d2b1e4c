"""Emulated boards: what the vendor's HIL module looks like, with the stage's physics behind it.

The real driver runs on them unchanged. Lockstep: the boards' time stands still until a sample is
waited for. Real time: it follows the machine's clock, however late one reads, unless the parameters
ask for patience.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.emulation.card import Clock, Code, DigitalState, EmulatedCard, HILError
from maglev_hw_bridge.emulation.lines import Lines
from maglev_hw_bridge.emulation.rig import Rig
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import CHANNELS
from maglev_model.axes import FloatArray

_STANDSTILL = 0.25
"""Share of the patience after which the boards stand still with a bridge that is stopped."""


def make(parameters: BridgeParameters, realtime: bool) -> EmulatedDriver:
    """The Quanser driver on emulated boards."""
    return EmulatedDriver(parameters, EmulatedBoards(parameters, realtime))


class EmulatedDriver(QuanserDriver):
    """The Quanser driver, which on emulated boards can also tell the truth."""

    def __init__(self, parameters: BridgeParameters, boards: EmulatedBoards) -> None:
        super().__init__(parameters, boards, boards.now, boards.sleep)
        self.boards = boards
        self._first = 0

    def start(self) -> None:
        """Start, and remember the boards' tick."""
        super().start()
        self._first = self.boards.ticks

    def truth(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The truth behind the sample read last, even where it was read late; see the protocol."""
        row = self.boards.past[(self._first + self._ticks) % len(self.boards.past)].copy()
        return row[:10], row[10:18], row[18:]


class EmulatedBoards:
    """Stands in for the vendor's module, and is the world behind its boards.

    Faults, from now on: ``stuck``, ``jumps`` (counts added) by encoder; ``dead(phase)``;
    ``delay(samples)``; ``failing`` (every call raises); ``stop_pressed``; :meth:`expire`.
    ``lines`` are the first board's digital lines, which outlast a bridge as the outputs do.
    """

    HILError = HILError
    Clock = Clock
    DigitalState = DigitalState

    def __init__(
        self,
        parameters: BridgeParameters,
        realtime: bool = False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.rig = Rig(parameters)
        self.parameters = parameters
        self.period = parameters.sample_time
        self.realtime = realtime
        self._clock, self._sleep = clock, sleep
        self._started = clock()
        self._stood_still = 0.0  # real time [s]
        patience = parameters.emulation.patience
        self._longest = max(1, round(_STANDSTILL * patience / self.period)) if patience else 2**62
        self.ticks = 0
        self.cards: dict[str, EmulatedCard] = {}
        self.volts = np.zeros((2, CHANNELS))
        self.counters = np.zeros((2, CHANNELS), dtype=np.int32)
        self.jumps = np.zeros(6, dtype=np.int64)
        self.stuck = np.zeros(6, dtype=bool)
        self.failing = False
        self.dummy_loads = False  # in place of the motors: nothing moves
        self.lines = Lines(parameters)
        self.expired = np.zeros(2, dtype=bool)
        self._held = self.rig.counts()
        self.past = np.zeros((parameters.kept_samples + 2, 24))
        self._delay = 0
        self._inject = parameters.emulation.inject
        wiring = parameters.emulation.wiring
        self._outputs = (np.array(wiring.phase_board), np.array(wiring.phase_channel))
        self._no_current = np.array(wiring.offset)
        self._inputs = (np.array(wiring.encoder_board), np.array(wiring.encoder_channel))
        self._count()

    # -- the vendor's module -----------------------------------------------------------------------

    def HIL(self, card_type: str, identifier: str) -> EmulatedCard:  # noqa: N802
        """Open a board, as the vendor's class of that name does."""
        identifiers = self.parameters.boards.identifier
        if card_type != self.parameters.boards.type or identifier not in identifiers:
            raise HILError(Code.NO_SUCH_BOARD, f'there is no board {card_type} {identifier}')
        if self.failing:
            raise HILError(Code.HARDWARE, 'the board does not answer')
        if identifier in self.cards:
            raise HILError(Code.BOARD_BUSY, f'board {identifier} is in use')
        card = EmulatedCard(self, identifiers.index(identifier), identifier)
        self.cards[identifier] = card
        return card

    HIL.INFINITE = 2**32 - 1  # type: ignore[attr-defined]

    # -- the world ---------------------------------------------------------------------------------

    def now(self) -> float:
        """The boards' time; in real time the machine's, less what they stood still [s]."""
        self.catch_up()  # what it stopped in front of this, too, has stood still
        return self._moved() if self.realtime else self.ticks * self.period

    def _moved(self) -> float:
        """By the clock, less what the boards are known to have stood still [s]."""
        return self._clock() - self._stood_still

    def tick(self) -> None:
        """One sample passes."""
        self._inject_faults()
        rest = self.rig.state[::2] if self.dummy_loads else None
        self.rig.advance(self.outputs() if self.lines.enabled else self._no_current)
        if rest is not None:
            self.rig.place(rest)
        self.ticks += 1
        self._count()
        self.rig.tell(self.past[self.ticks % len(self.past)])
        for card in list(self.cards.values()):
            card.on_tick()

    def place(self, position: FloatArray, velocity: FloatArray | None = None) -> None:
        """Have the platen there (5,) [m, rad], by default at rest; the counters tell it."""
        self.rig.place(position, velocity)
        self._count()

    def outputs(self) -> NDArray[np.float64]:
        """What the amplifiers of the phases are asked for, shape (12,) [V]."""
        volts: NDArray[np.float64] = self.volts[self._outputs]
        return volts

    def catch_up(self) -> None:
        """In real time, let pass what has passed; what long stops the bridge stops the boards."""
        if self.realtime:
            behind = int((self._moved() - self._started) / self.period) - self.ticks
            still = max(0, behind - self._longest - self._delay)
            self._stood_still += still * self.period
            self._delay = 0
            for _ in range(behind - still):
                self.tick()

    def wait(self) -> None:
        """Let the next sample pass: at once, or by the clock."""
        if not self.realtime:
            late, self._delay = self._delay, 0
            for _ in range(1 + late):
                self.tick()
            return
        passed = self.ticks
        self.catch_up()
        if self.ticks > passed:
            return
        ahead = self._started + (self.ticks + 1) * self.period - self._moved()
        if ahead > 0.0:
            self._sleep(ahead)
        self.catch_up()

    @property
    def stop_pressed(self) -> bool:
        """Whether the emergency stop is pressed."""
        return self.lines.stop_pressed

    @stop_pressed.setter
    def stop_pressed(self, pressed: bool) -> None:
        self.lines.stop_pressed = pressed

    def sleep(self, seconds: float) -> None:
        """Let time pass on the boards while nobody waits for a sample."""
        if self.realtime:
            self._sleep(seconds)
            self.catch_up()
            return
        for _ in range(math.ceil(seconds / self.period - 1e-9)):
            self.tick()

    def dead(self, phase: int) -> None:
        """No current flows in a phase (0..11) any more."""
        self.rig.arrays.gain[phase] = 0.0

    def delay(self, samples: int) -> None:
        """The bridge reads its next sample this late."""
        self._delay = samples
        if self.realtime:
            self._sleep(samples * self.period)

    def expire(self) -> None:
        """The boards' watchdogs expire."""
        for card in self.cards.values():
            card.expire()

    def _inject_faults(self) -> None:
        inject = self._inject
        if self.ticks != inject.sample:
            return
        if inject.dead_phase >= 0:
            self.dead(inject.dead_phase)
        if inject.stuck_encoder >= 0:
            self.stuck[inject.stuck_encoder] = True
        if inject.jumping_encoder >= 0:
            self.jumps[inject.jumping_encoder] += inject.jump
        if inject.late:
            self.delay(inject.late)
        self.failing = self.failing or inject.error
        self.stop_pressed = self.stop_pressed or inject.stop_input
        if inject.expired_watchdog:
            self.expire()

    def _count(self) -> None:
        counts = self.rig.counts() + self.jumps
        np.copyto(counts, self._held, where=self.stuck)
        self._held = counts
        self.counters[self._inputs] = counts.astype(np.int32)
