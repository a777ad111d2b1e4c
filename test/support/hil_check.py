"""A strict stand-in for the vendor's HIL module: checks every call and knows no physics.

Independent of the bridge's own emulation: buffers must have the right type and length, calls must
come in an order that real boards take, outputs must end without current, and nothing may follow
``close``. Time passes where the driver sleeps; watchdogs expire in it. As a Q8's, digital lines
that nothing drives are high, also those of a board whose watchdog has expired, and to clear that
drives them again as before.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

ANALOG, DIGITAL = 8, 32
INTERRUPTED = -35


class CallError(BaseException):
    """A call that real boards would take for something else, or refuse.

    No Exception, so that nobody who expects boards to fail catches it.
    """


class HILError(Exception):
    """What the vendor's calls raise."""

    def __init__(self, text: str = '', error_code: int = -1) -> None:
        super().__init__(error_code)
        self.error_code, self._text = error_code, text

    def get_error_message(self) -> str:
        return self._text


@dataclasses.dataclass
class Trouble:
    """What goes wrong: calls of a board (any: None), so many times, and how."""

    call: str | set[str]
    board: int | None = None
    times: float = np.inf
    kind: str = 'error'  # or interrupted, foreign, wrong

    def strikes(self, call: str, board: int) -> bool:
        """Whether that call goes wrong; counts it."""
        calls = {self.call} if isinstance(self.call, str) else self.call
        if call not in calls or self.board not in (None, board) or self.times <= 0:
            return False
        self.times -= 1
        return True

    def error(self) -> Exception | None:
        """What is raised; None: the call does nothing and returns something wrong."""
        return {
            'error': HILError(f'{self.call} failed'),
            'interrupted': HILError('interrupted', INTERRUPTED),
            'foreign': OSError(f'{self.call} failed'),
            'wrong': None,
        }[self.kind]


class Clock:
    HARDWARE_CLOCK_0 = 0


class DigitalState:
    LOW, HIGH, TRISTATE, NO_CHANGE = 0, 1, 2, 3


def require(condition: bool, message: str) -> None:
    if not condition:
        raise CallError(message)


def check_buffer(name: str, buffer: Any, dtype: Any, n: int) -> None:
    require(isinstance(buffer, np.ndarray), f'{name} is no array')
    if buffer.dtype != dtype:
        raise CallError(f'{name} is {buffer.dtype}, it must be {np.dtype(dtype)}')
    require(type(n) is int and buffer.shape == (n,), f'{name} has another shape than n = {n}')
    require(buffer.flags.c_contiguous, f'{name} is not contiguous')


def check_channels(channels: Any, n: int, number: int) -> None:
    check_buffer('channels', channels, np.uint32, n)
    numbers = channels.tolist()
    if len(set(numbers)) < n or max(numbers, default=0) >= number:
        raise CallError(f'channels repeat or are not there: {channels}')


class _WrongError(Exception):
    """The call does nothing."""


class Card:
    """One board."""

    def __init__(self, module: Module, identifier: str) -> None:
        self.module, self.identifier = module, identifier
        self.number = int(identifier)
        self.calls: list[str] = []
        self.open, self.watchdog, self.expired = True, False, False
        self.timeout = self.deadline = 0.0
        self.task: str | None = None
        self.states: set[str] = set()
        self.ranges: dict[int, float] = {}
        self.volts = np.full(ANALOG, np.nan)
        self.written: list[np.ndarray] = []
        self.reloads = 0
        self.ticks = 0
        self.outputs = np.zeros(DIGITAL, dtype=bool)
        self.latch = np.zeros(DIGITAL, dtype=np.int8)

    def _call(self, name: str, *, while_expired: bool = False) -> None:
        require(self.open, f'{name} after close')
        self.calls.append(name)
        trouble = self.module.trouble
        if trouble is not None and trouble.strikes(name, self.number):
            error = trouble.error()
            raise _WrongError if error is None else error
        if self.expired and not while_expired:
            raise HILError('the watchdog has expired')

    def __getattribute__(self, name: str) -> Any:
        """A call that does nothing and returns 0, where that is the trouble."""
        found = object.__getattribute__(self, name)
        if name.startswith('_') or not callable(found):
            return found

        def call(*arguments: Any) -> Any:
            try:
                return found(*arguments)
            except _WrongError:
                return 0

        return call

    @property
    def levels(self) -> np.ndarray:
        """Of the digital lines: pulled up where nothing drives them."""
        driven = self.outputs & (not self.expired)
        return np.where(driven, self.latch, 1)

    def set_analog_output_ranges(self, channels: Any, n: int, minima: Any, maxima: Any) -> None:
        self._call('set_analog_output_ranges')
        check_channels(channels, n, ANALOG)
        check_buffer('minima', minima, np.float64, n)
        check_buffer('maxima', maxima, np.float64, n)
        require(bool(np.all(minima == -maxima) and np.all(maxima > 0)), 'ranges of a Q8 are +-V')
        self.ranges.update(zip(channels.tolist(), maxima.tolist(), strict=True))

    def write_analog(self, channels: Any, n: int, volts: Any) -> None:
        self._call('write_analog')
        check_channels(channels, n, ANALOG)
        check_buffer('volts', volts, np.float64, n)
        for channel, value in zip(channels.tolist(), volts.tolist(), strict=True):
            require(abs(value) <= self.ranges.get(channel, np.inf), f'{value} V is out of range')
        self.volts[channels] = volts
        self.written.append(volts.copy())

    def read_encoder(self, channels: Any, n: int, counts: Any) -> None:
        self._call('read_encoder')
        check_channels(channels, n, ANALOG)
        check_buffer('counts', counts, np.int32, n)
        counts[:] = self.module.counts[channels]

    def set_digital_directions(self, inputs: Any, m: int, outputs: Any, n: int) -> None:
        self._call('set_digital_directions')
        check_channels(inputs, m, DIGITAL)
        check_channels(outputs, n, DIGITAL)
        self.outputs[inputs], self.outputs[outputs] = False, True

    def read_digital(self, channels: Any, n: int, values: Any) -> None:
        self._call('read_digital')
        check_channels(channels, n, DIGITAL)
        check_buffer('values', values, np.int8, n)
        values[:] = self.module.stop_level

    def write_digital(self, channels: Any, n: int, values: Any) -> None:
        self._call('write_digital')
        check_channels(channels, n, DIGITAL)
        check_buffer('values', values, np.int8, n)
        self.latch[channels] = values

    def task_create_encoder_reader(self, size: int, channels: Any, n: int) -> str:
        self._call('task_create_encoder_reader')
        require(type(size) is int and size > 0, 'the buffer needs room')
        require(self.task is None, 'there is a task already')
        check_channels(channels, n, ANALOG)
        self.channels, self.task = channels.copy(), 'created'
        return 'task'

    def task_start(self, task: Any, clock: Any, frequency: float, samples: int) -> None:
        self._call('task_start')
        if self.module.trouble is None:
            require(task == 'task' and self.task == 'created', 'no task to start')
        require(clock == Clock.HARDWARE_CLOCK_0, 'not paced by the hardware clock')
        require(type(frequency) is float and frequency == 1000.0, f'{frequency} Hz')
        require(samples == Module.HIL.INFINITE, 'the task would end')
        require(self.watchdog or self.module.trouble is not None, 'samples without a watchdog')
        if self.task is None:
            raise HILError('there is no such task')
        self.task = 'running'

    def task_read_encoder(self, task: Any, samples: int, counts: Any) -> int:
        self._call('task_read_encoder')
        if self.task != 'running' and self.module.trouble is not None:
            return 0
        require(task == 'task' and self.task == 'running' and samples == 1, 'no running task')
        check_buffer('counts', counts, np.int32, len(self.channels))
        counts[:] = self.module.counts[self.channels]
        self.ticks += 1
        return 1

    def task_stop(self, task: Any) -> None:
        self._call('task_stop', while_expired=True)
        started = self.task == 'running' or self.module.trouble is not None
        require(self.task == 'created' or started, 'no task')
        self.task = 'stopped'

    def task_delete(self, task: Any) -> None:
        self._call('task_delete', while_expired=True)
        stopped = self.task in ('stopped', 'created')
        require(stopped or self.module.trouble is not None, 'deleted while it runs')
        self.task = None

    def watchdog_set_analog_expiration_state(self, channels: Any, n: int, volts: Any) -> None:
        self._call('watchdog_set_analog_expiration_state')
        check_channels(channels, n, ANALOG)
        check_buffer('volts', volts, np.float64, n)
        require(not self.watchdog, 'states are set before the watchdog is started')
        require(not np.any(volts), 'a Q8 goes to 0 V')
        self.states.update(f'analog {channel}' for channel in channels.tolist())

    def watchdog_set_digital_expiration_state(self, channels: Any, n: int, states: Any) -> None:
        self._call('watchdog_set_digital_expiration_state')
        check_channels(channels, n, DIGITAL)
        check_buffer('states', states, np.int32, n)
        require(not self.watchdog, 'states are set before the watchdog is started')
        require(bool(np.all(states == DigitalState.TRISTATE)), 'a Q8 goes to tristate')
        self.states.add('digital')

    def watchdog_start(self, timeout: float) -> None:
        self._call('watchdog_start')
        require(type(timeout) is float and 0.0 < timeout <= 0.1, f'time-out {timeout}')
        require(not self.watchdog, 'started twice')
        if self.module.trouble is None:
            wanted = {f'analog {channel}' for channel in self.ranges} | {'digital'}
            require(wanted <= self.states, f'no expiration state for {wanted - self.states}')
            require(self.resting, 'armed with an output that makes current')
        self.watchdog, self.timeout = True, timeout
        self.deadline = self.module.time + timeout

    def watchdog_reload(self) -> bool:
        self._call('watchdog_reload', while_expired=True)
        if not self.watchdog and self.module.trouble is not None:
            return False
        require(self.watchdog or self.expired, 'reloaded without a watchdog')
        self.reloads += 1
        self.deadline = self.module.time + self.timeout
        return not self.expired

    def watchdog_is_expired(self) -> bool:
        self._call('watchdog_is_expired', while_expired=True)
        return self.expired

    def watchdog_clear(self) -> None:
        self._call('watchdog_clear', while_expired=True)
        require(self.expired, 'cleared without need')
        self.expired = False

    def watchdog_stop(self) -> None:
        self._call('watchdog_stop', while_expired=True)
        require(self.resting, 'the watchdog is stopped with an output that makes current')
        if self.number == 0:
            require(self.module.disabled, 'the watchdog is stopped with the amplifiers enabled')
        self.watchdog = False

    def close(self) -> None:
        self._call('close', while_expired=True)
        if self.module.trouble is None:
            require(not self.watchdog, 'closed with the watchdog armed')
            require(self.task is None, 'closed with a task')
            require(self.resting, 'closed with an output that makes current')
        self.open = False

    def expire(self) -> None:
        """The watchdog expires: 0 V, and no digital line is driven."""
        self.watchdog, self.expired = False, True
        self.volts[:] = 0.0

    @property
    def resting(self) -> bool:
        """Whether its outputs make no current; those never written are at 0 V from power-up."""
        rest = self.module.rest[self.number]
        return all(np.nan_to_num(self.volts[channel]) == volts for channel, volts in rest.items())


class Module:
    """The vendor's module, for one test; ``offset``: what makes no current, by phase [V]."""

    Clock, DigitalState, HILError = Clock, DigitalState, HILError

    class HIL:
        INFINITE = 2**32 - 1

    def __init__(
        self, *, left_expired: bool = False, offset: float = 0.0, enable_line: int = -1
    ) -> None:
        module = self
        self.cards: list[Card] = []
        self.counts = np.zeros(ANALOG, dtype=np.int32)
        self.trouble: Trouble | None = None
        self.stop_level = 0
        self.time = 0.0
        self.rest = [dict.fromkeys(range(6), offset) for _ in range(2)]
        self.enable_line = enable_line

        class Hil(Module.HIL):
            def __new__(cls, card_type: str, identifier: str) -> Any:  # type: ignore[misc]
                require(card_type == 'q8' and identifier in ('0', '1'), 'no such board')
                require(all(c.identifier != identifier or not c.open for c in module.cards), 'busy')
                trouble = module.trouble
                if trouble is not None and trouble.strikes('HIL', int(identifier)):
                    raise trouble.error() or HILError('the board was not found')
                card = Card(module, identifier)
                card.expired = left_expired
                module.cards.append(card)
                return card

        self.HIL = Hil  # type: ignore[misc,assignment]

    def sleep(self, seconds: float) -> None:
        """Time passes; watchdogs that nobody reloads expire."""
        self.time += seconds
        for card in self.cards:
            if card.watchdog and self.time >= card.deadline - 1e-9:
                card.expire()

    @property
    def enabled(self) -> bool:
        """Whether the amplifiers are enabled, by a line that is low; always without one."""
        boards = [card for card in self.cards if card.number == 0]
        if self.enable_line < 0 or not boards:
            return self.enable_line < 0
        return bool(boards[-1].levels[self.enable_line] == 0)

    @property
    def disabled(self) -> bool:
        """Whether they are disabled, as far as that can be."""
        return self.enable_line < 0 or not self.enabled

    def check_end(self) -> None:
        """No handle is open; each board makes no current or its watchdog has seen to that."""
        newest = {card.number: card for card in self.cards}
        for card in newest.values():
            require(not card.open, f'board {card.identifier} is still open')
            safe = card.resting or card.expired or not card.written
            require(safe, f'board {card.identifier} is left at {card.volts}')
        require(self.disabled, 'the amplifiers are left enabled')

    def __getattr__(self, name: str) -> Any:
        raise CallError(f'the vendor has no {name}')
