"""Emulated boards and the machine behind them, made to fail; and what truly happens there.

Everything here is the world's side: it fails as boards, encoders and amplifiers do, and is looked
at by the judge. Nothing of it is known to the bridge.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.emulation.card import EmulatedCard
from maglev_hw_bridge.parameters import BridgeParameters

CALLS = (
    'HIL',
    'set_analog_output_ranges',
    'read_encoder',
    'write_analog',
    'set_digital_directions',
    'read_digital',
    'write_digital',
    'task_create_encoder_reader',
    'task_start',
    'task_read_encoder',
    'task_stop',
    'task_delete',
    'watchdog_set_analog_expiration_state',
    'watchdog_set_digital_expiration_state',
    'watchdog_start',
    'watchdog_stop',
    'watchdog_reload',
    'watchdog_is_expired',
    'watchdog_clear',
    'close',
)
"""Of the vendor's module that the bridge makes."""

Behaviour = Callable[[Callable[..., Any], tuple[Any, ...]], Any]
"""What a failing call does: takes the sound call and its arguments."""


class FaultyCard:
    """A board whose calls can be made to fail; sound ones cost nothing."""

    def __init__(self, world: World, card: EmulatedCard, number: int) -> None:
        self._world, self._card, self._number = world, card, number
        self.update()

    def update(self) -> None:
        """Take over which calls fail from now on."""
        for name in CALLS[1:]:
            setattr(self, name, self._world.failing_call(name, self._number, self._card))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._card, name)


class World(EmulatedBoards):
    """The boards, with faults that last from when they are set until they are cured."""

    def __init__(self, parameters: BridgeParameters) -> None:
        self.noise = np.zeros(6, dtype=np.int64)  # greatest, of each encoder [counts]
        self.deviation = np.zeros(6, dtype=np.int64)  # of what is counted from the truth
        self.stuck_on = np.full(12, np.nan)  # voltage that a phase's amplifier takes for given
        self.observe: Callable[[], None] = lambda: None  # called after each sample that passed
        self.rng = np.random.default_rng(0)
        self._behaviour: dict[tuple[str, int], Behaviour] = {}
        self._proxies: list[FaultyCard] = []
        self._gains = np.zeros(12)
        super().__init__(parameters)
        self._gains[:] = self.rig.arrays.gain
        self._held = self.rig.counts()

    # -- the vendor's module -----------------------------------------------------------------------

    def HIL(self, card_type: str, identifier: str) -> Any:  # noqa: N802
        """Open a board, as the vendor's class does."""
        number = int(identifier)
        behaviour = self._behaviour.get(('HIL', number))
        if behaviour is None:
            return self._open(card_type, identifier)
        return behaviour(self._open, (card_type, identifier))

    HIL.INFINITE = 2**32 - 1  # type: ignore[attr-defined]

    def _open(self, card_type: str, identifier: str) -> FaultyCard:
        card = super().HIL(card_type, identifier)
        number = int(identifier)
        proxy = FaultyCard(self, card, number)
        self._proxies.append(proxy)
        return proxy

    def fail(self, name: str, board: int, behaviour: Behaviour) -> None:
        """Let a call behave like that from now on."""
        self._behaviour[name, board] = behaviour
        self._update()

    def failing_call(self, name: str, board: int, card: EmulatedCard) -> Any:
        """A card's call as it behaves now."""
        sound = getattr(card, name, None)
        behaviour = self._behaviour.get((name, board))
        if behaviour is None or sound is None:
            return sound
        return lambda *arguments: behaviour(sound, arguments)

    def _update(self) -> None:
        for proxy in self._proxies:
            proxy.update()

    def refresh(self) -> None:
        """What counters have lost shows at once, not at the next sample only."""
        self._count()

    def process_ended(self) -> None:
        """The bridge's process is gone: the system closes the handles it has left open."""
        self.cards.clear()
        self._proxies.clear()

    # -- the machine -------------------------------------------------------------------------------

    def tick(self) -> None:
        """One sample passes."""
        super().tick()
        self.observe()

    def outputs(self) -> NDArray[np.float64]:
        """What the amplifiers take for what they are asked for, shape (12,) [V]."""
        volts = super().outputs()
        if self._faulty_amplifiers:
            volts = np.where(np.isnan(self.stuck_on), volts, self.stuck_on)
        return volts

    _faulty_amplifiers = False

    def stick_on(self, phase: int, volts: float) -> None:
        """An amplifier puts out what this voltage asks for, until it is disabled."""
        self.stuck_on[phase] = volts
        self._faulty_amplifiers = True

    def scale_gain(self, phase: int, factor: float) -> None:
        """An amplifier delivers so many times what it is asked for; 0 is dead."""
        self.rig.arrays.gain[phase] = self._gains[phase] * factor

    @property
    def enabled(self) -> bool:
        """Whether the amplifiers' enable line says so."""
        return self.lines.enabled

    def let_pass(self, time: float) -> None:
        """Time [s] passes, with nobody calling."""
        for _ in range(round(time / self.period)):
            self.tick()

    def cure(self) -> None:
        """Everything is sound from now on; what counters have lost stays lost."""
        self.stuck[:] = False
        self.noise[:] = 0
        self.stuck_on[:] = np.nan
        self._faulty_amplifiers = False
        self.rig.arrays.gain[:] = self._gains
        self.stop_pressed = False
        self._behaviour.clear()
        self._update()

    def rest(self) -> None:
        """The platen is put on its lower stop, as by hand."""
        machine = self.parameters.machine
        self.rig.place(np.array([machine.gap_max, 0.0, 0.0, 0.0, 0.0]))
        self.rig.arrays.current[:] = 0.0
        self._count()

    def _count(self) -> None:
        true = self.rig.counts()
        counts = true + self.jumps
        if any(self.noise.tolist()):
            counts = counts + self.rng.integers(-self.noise, self.noise + 1)
        np.copyto(counts, self._held, where=self.stuck)
        self._held = counts
        np.subtract(counts, true, out=self.deviation)
        self.counters[self._inputs] = counts.astype(np.int32)
