"""One emulated board: the vendor's calls, on raw memory as the real ones.

A buffer of the wrong type is silently taken for something else; an expired watchdog puts out 0 V,
lets go of the digital lines, which are then pulled up, and refuses everything until it is cleared.
"""

from __future__ import annotations

import enum
from collections import deque
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.emulation.lines import LINES, Lines
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import CHANNELS


class HILError(Exception):
    """What every call of the boards raises; ``error_code`` as the vendor numbers them, negative."""

    def __init__(self, error_code: int, message: str) -> None:
        super().__init__(f'{message} ({error_code})')
        self.error_code = error_code
        self._message = message

    def get_error_message(self, locale: str | None = None) -> str:
        """The error in words."""
        return self._message


class Clock(enum.IntEnum):
    """The board's clocks."""

    HARDWARE_CLOCK_0 = 0
    HARDWARE_CLOCK_1 = 1


class DigitalState(enum.IntEnum):
    """What a digital line is set to when the watchdog expires."""

    LOW = 0
    HIGH = 1
    TRISTATE = 2
    NO_CHANGE = 3


class Code(enum.IntEnum):
    """Error codes; the numbers are the emulation's own."""

    NO_SUCH_BOARD = -1
    BOARD_BUSY = -2
    BAD_CHANNEL = -3
    CLOSED = -4
    WATCHDOG_EXPIRED = -5
    BUFFER_OVERFLOW = -6
    NO_SUCH_TASK = -7
    HARDWARE = -8


class World(Protocol):
    """What a board is part of."""

    parameters: BridgeParameters
    period: float
    ticks: int
    volts: NDArray[np.float64]  # (boards, CHANNELS)
    counters: NDArray[np.int32]  # (boards, CHANNELS)
    cards: dict[str, EmulatedCard]
    failing: bool
    lines: Lines  # of the first board
    expired: NDArray[np.bool_]  # watchdogs, until they are cleared

    def catch_up(self) -> None:
        """Let pass what has passed."""
        ...

    def wait(self) -> None:
        """Let the next sample pass."""
        ...


class EmulatedCard:
    """One board, with the vendor's calls."""

    def __init__(self, world: World, number: int, identifier: str) -> None:
        self._world, self._number, self._identifier = world, number, identifier
        self._open = True
        self._task: _Task | None = None
        self._expiration = False
        self._timeout = 0.0
        self._deadline: int | None = None
        self._lines = world.lines if number == 0 else Lines(world.parameters)

    # Immediate input and output

    def set_analog_output_ranges(self, channels: Any, n: int, minima: Any, maxima: Any) -> None:
        """Ranges of the outputs [V]; a Q8 has them symmetric."""
        self._check()
        _channels(channels, n, CHANNELS)
        _memory(minima, np.float64, n)
        _memory(maxima, np.float64, n)

    def read_encoder(self, channels: Any, n: int, counts: Any) -> None:
        """Counters right now, int32."""
        self._check()
        which = _channels(channels, n, CHANNELS)
        _memory(counts, np.int32, n)[:] = self._world.counters[self._number, which]

    def write_analog(self, channels: Any, n: int, volts: Any) -> None:
        """Outputs, float64 [V]."""
        self._check()
        which = _channels(channels, n, CHANNELS)
        self._world.volts[self._number, which] = _memory(volts, np.float64, n)

    def set_digital_directions(
        self, inputs: Any, n_inputs: int, outputs: Any, n_outputs: int
    ) -> None:
        """Which digital lines are inputs and outputs."""
        self._check()
        self._lines.direct(_channels(inputs, n_inputs, LINES), _channels(outputs, n_outputs, LINES))

    def read_digital(self, channels: Any, n: int, values: Any) -> None:
        """Digital lines, int8."""
        self._check()
        which = _channels(channels, n, LINES).tolist()
        _memory(values, np.int8, n)[:] = [self._lines.level(line) for line in which]

    def write_digital(self, channels: Any, n: int, values: Any) -> None:
        """Digital lines, int8."""
        self._check()
        self._lines.write(_channels(channels, n, LINES), _memory(values, np.int8, n))

    # Encoder reader task

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Any, n: int) -> _Task:
        """A task that reads counters at every tick into a buffer."""
        self._check()
        return _Task(samples_in_buffer, _channels(channels, n, CHANNELS).copy())

    def task_start(self, task: _Task, clock: Clock, frequency: float, samples: int) -> None:
        """Start it on a clock; the emulated hardware clock has the stage's own period."""
        self._check()
        if abs(frequency * self._world.period - 1.0) > 1e-9:
            raise HILError(Code.HARDWARE, f'the emulated clock cannot tick at {frequency:g} Hz')
        task.running = True
        self._task = task

    def task_read_encoder(self, task: _Task, samples: int, counts: Any) -> int:
        """Wait for a sample and read it, int32; raises when samples were lost meanwhile."""
        self._check()
        if not task.running:
            raise HILError(Code.NO_SUCH_TASK, 'the task does not run')
        if task.overflown:
            raise HILError(Code.BUFFER_OVERFLOW, 'samples were lost: the buffer was full')
        n = len(task.channels)
        buffer = _memory(counts, np.int32, n * samples)
        for i in range(samples):
            while not task.buffer:
                self._world.wait()
                self._check()
            buffer[i * n : (i + 1) * n] = task.buffer.popleft()
        return samples

    def task_stop(self, task: _Task) -> None:
        """Stop it."""
        self._check(expired=True)
        task.running = False

    def task_delete(self, task: _Task) -> None:
        """Release it."""
        self._check(expired=True)
        self._task = None

    # Watchdog

    def watchdog_set_analog_expiration_state(self, channels: Any, n: int, volts: Any) -> None:
        """What the outputs become when it expires: a Q8 knows 0 V only."""
        self._check()
        _channels(channels, n, CHANNELS)
        if np.any(_memory(volts, np.float64, n)):
            raise HILError(Code.HARDWARE, 'a Q8 can only be set to 0 V on expiration')
        self._expiration = True

    def watchdog_set_digital_expiration_state(self, channels: Any, n: int, states: Any) -> None:
        """What the digital lines become when it expires: a Q8 knows tristate only, int32."""
        self._check()
        _channels(channels, n, LINES)
        if np.any(_memory(states, np.int32, n) != DigitalState.TRISTATE):
            raise HILError(Code.HARDWARE, 'a Q8 can only be set to tristate on expiration')

    def watchdog_start(self, timeout: float) -> None:
        """Start it; states set later have no effect."""
        self._check()
        self._timeout = timeout
        self._reload()

    def watchdog_stop(self) -> None:
        """Stop it."""
        self._check(expired=True)
        self._deadline = None

    def watchdog_reload(self) -> bool:
        """Start it over; false when it had expired."""
        self._check(expired=True)
        if self._world.expired[self._number]:
            return False
        self._reload()
        return True

    def watchdog_is_expired(self) -> bool:
        """Whether it has expired."""
        self._check(expired=True)
        return bool(self._world.expired[self._number])

    def watchdog_clear(self) -> None:
        """Allow access again."""
        self._check(expired=True)
        self._world.expired[self._number] = False
        self._lines.let_go(False)

    def close(self) -> None:
        """Release the board; without a watchdog its outputs keep their voltage."""
        self._open = False
        self._world.cards.pop(self._identifier, None)

    # The world's side

    def on_tick(self) -> None:
        """A sample has passed on the board."""
        if self._deadline is not None and self._world.ticks >= self._deadline:
            self.expire()
        if self._task is not None and self._task.running:
            self._task.take(self._world.counters[self._number])

    def expire(self) -> None:
        """The watchdog expires: 0 V and no digital outputs, if that was asked for before it."""
        self._deadline = None
        self._world.expired[self._number] = True
        if self._expiration:
            self._world.volts[self._number] = 0.0
            self._lines.let_go(True)

    def _reload(self) -> None:
        self._deadline = self._world.ticks + max(1, round(self._timeout / self._world.period))

    def _check(self, expired: bool = False) -> None:
        """Whether a call can be answered; ``expired``: also by a board whose watchdog expired."""
        if not self._open:
            raise HILError(Code.CLOSED, 'the board is closed')
        if self._world.failing:
            raise HILError(Code.HARDWARE, 'the board does not answer')
        self._world.catch_up()
        if self._world.expired[self._number] and not expired:
            raise HILError(Code.WATCHDOG_EXPIRED, 'the watchdog has expired')


class _Task:
    """An encoder reader."""

    def __init__(self, size: int, channels: NDArray[np.uint32]) -> None:
        self.size, self.channels = size, channels
        self.buffer: deque[NDArray[np.int32]] = deque()
        self.running = self.overflown = False

    def take(self, counters: NDArray[np.int32]) -> None:
        """Keep a sample."""
        if len(self.buffer) >= self.size:
            self.overflown = True
            return
        self.buffer.append(counters[self.channels])


def _memory(buffer: Any, dtype: Any, n: int) -> NDArray[Any]:
    """What the real calls see: the buffer's memory, whatever was meant to be in it."""
    if n == 0:
        return np.zeros(0, dtype=dtype)
    return np.frombuffer(buffer, dtype=dtype, count=n)


def _channels(buffer: Any, n: int, number: int) -> NDArray[np.uint32]:
    channels = _memory(buffer, np.uint32, n)
    highest = max(channels.tolist(), default=0)
    if highest >= number:
        raise HILError(Code.BAD_CHANNEL, f'there is no channel {highest}')
    return channels
