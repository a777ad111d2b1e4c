"""The digital lines of the first emulated board, and what is wired to them.

As a Q8's: what nothing drives is pulled up. An expired watchdog lets go of all lines, and to clear
it drives them again as they were.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters

LINES = 32
_PULLED_UP = 1


class Lines:
    """Levels of the lines; a contact for the emergency stop, the amplifiers' enable input."""

    def __init__(self, parameters: BridgeParameters) -> None:
        boards, wiring = parameters.boards, parameters.emulation.wiring

        def really(wired: int, claimed: int) -> int:
            return claimed if wired < 0 else wired

        self._stop = really(wiring.stop_line, boards.stop_input)
        self._stop_level = really(wiring.stop_level, boards.stop_level)
        self._enable = really(wiring.enable_line, boards.enable_output)
        self._enable_level = really(wiring.enable_level, boards.enable_level)
        self.stop_pressed = False
        self.stop_plugged = True
        self._written = np.zeros(LINES, dtype=np.int8)
        self._output = np.zeros(LINES, dtype=bool)
        self._let_go = False  # by an expired watchdog

    def direct(self, inputs: NDArray[np.uint32], outputs: NDArray[np.uint32]) -> None:
        """Make lines inputs, and outputs."""
        self._output[inputs], self._output[outputs] = False, True

    def write(self, lines: NDArray[np.uint32], values: NDArray[np.int8]) -> None:
        """What outputs among the lines are driven to, now or once they are outputs."""
        self._written[lines] = values

    def let_go(self, expired: bool) -> None:
        """An expired watchdog lets go of all lines; cleared, they are driven as before."""
        self._let_go = expired

    def level(self, line: int) -> int:
        """Of one line."""
        if self._output[line] and not self._let_go:
            return int(self._written[line])
        if line == self._stop and self.stop_plugged:
            return self._stop_level if self.stop_pressed else 1 - self._stop_level
        return _PULLED_UP

    @property
    def enabled(self) -> bool:
        """Whether the amplifiers carry current: always where no line enables them."""
        line = self._enable
        if line < 0:
            return True
        driven = self._output[line] and not self._let_go
        return bool((self._written[line] if driven else _PULLED_UP) == self._enable_level)
