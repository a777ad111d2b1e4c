"""A strict stand-in for the vendor's HIL module: checks every call and knows no physics.

Independent of the bridge's own emulation: buffers must have the right type and length, calls must
come in an order that real boards take, outputs must end at 0 V, and nothing may follow ``close``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

ANALOG, DIGITAL = 8, 32


class CallError(AssertionError):
    """A call that real boards would take for something else, or refuse."""


class HILError(Exception):
    """What the vendor's calls raise."""

    def get_error_message(self) -> str:
        return str(self)


class Clock:
    HARDWARE_CLOCK_0 = 0


class DigitalState:
    LOW, HIGH, TRISTATE = 0, 1, 2


def require(condition: bool, message: str) -> None:
    if not condition:
        raise CallError(message)


def check_buffer(name: str, buffer: Any, dtype: Any, n: int) -> None:
    require(isinstance(buffer, np.ndarray), f'{name} is no array')
    require(buffer.dtype == dtype, f'{name} is {buffer.dtype}, it must be {np.dtype(dtype)}')
    require(type(n) is int and buffer.shape == (n,), f'{name} has {buffer.shape} for n = {n}')
    require(buffer.flags.c_contiguous, f'{name} is not contiguous')


def check_channels(channels: Any, n: int, number: int) -> None:
    check_buffer('channels', channels, np.uint32, n)
    require(len(set(channels.tolist())) == n, f'channels repeat: {channels}')
    require(all(channel < number for channel in channels), f'no such channel in {channels}')


class Card:
    """One board."""

    def __init__(self, module: Module, identifier: str) -> None:
        self.module, self.identifier = module, identifier
        self.calls: list[str] = []
        self.open, self.watchdog, self.expired = True, False, False
        self.task: str | None = None
        self.states: set[str] = set()
        self.ranges: dict[int, float] = {}
        self.volts = np.full(ANALOG, np.nan)
        self.written: list[np.ndarray] = []
        self.reloads = 0
        self.ticks = 0

    def _call(self, name: str, *, while_expired: bool = False) -> None:
        require(self.open, f'{name} after close')
        self.calls.append(name)
        if self.module.fail_at == name:
            raise HILError(f'{name} failed')
        if self.expired and not while_expired:
            raise HILError('the watchdog has expired')

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
            require(abs(value) <= self.ranges.get(channel, 0.0), f'{value} V is out of range')
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

    def read_digital(self, channels: Any, n: int, values: Any) -> None:
        self._call('read_digital')
        check_channels(channels, n, DIGITAL)
        check_buffer('values', values, np.int8, n)
        values[:] = self.module.stop_level

    def write_digital(self, channels: Any, n: int, values: Any) -> None:
        self._call('write_digital')
        check_channels(channels, n, DIGITAL)
        check_buffer('values', values, np.int8, n)
        self.module.enabled = bool(values[0])

    def task_create_encoder_reader(self, size: int, channels: Any, n: int) -> str:
        self._call('task_create_encoder_reader')
        require(type(size) is int and size > 0, 'the buffer needs room')
        require(self.task is None, 'there is a task already')
        check_channels(channels, n, ANALOG)
        self.channels, self.task = channels.copy(), 'created'
        return 'task'

    def task_start(self, task: Any, clock: Any, frequency: float, samples: int) -> None:
        self._call('task_start')
        require(task == 'task' and self.task == 'created', 'no task to start')
        require(clock == Clock.HARDWARE_CLOCK_0, 'not paced by the hardware clock')
        require(type(frequency) is float and frequency == 1000.0, f'{frequency} Hz')
        require(samples == Module.HIL.INFINITE, 'the task would end')
        require(self.watchdog, 'samples before the watchdog is armed')
        self.task = 'running'

    def task_read_encoder(self, task: Any, samples: int, counts: Any) -> int:
        self._call('task_read_encoder')
        require(task == 'task' and self.task == 'running' and samples == 1, 'no running task')
        check_buffer('counts', counts, np.int32, len(self.channels))
        counts[:] = self.module.counts[self.channels]
        self.ticks += 1
        return 1

    def task_stop(self, task: Any) -> None:
        self._call('task_stop', while_expired=True)
        require(task == 'task' and self.task == 'running', 'no running task')
        self.task = 'stopped'

    def task_delete(self, task: Any) -> None:
        self._call('task_delete', while_expired=True)
        stopped = self.task in ('stopped', 'created')
        require(stopped or self.module.fail_at == 'task_stop', 'deleted while it runs')
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
        wanted = {f'analog {channel}' for channel in self.ranges} | {'digital'}
        require(wanted <= self.states, f'no expiration state for {wanted - self.states}')
        require(not np.any(self.volts[list(self.ranges)]), 'armed with an output that is not 0 V')
        self.watchdog = True

    def watchdog_reload(self) -> bool:
        self._call('watchdog_reload', while_expired=True)
        require(self.watchdog, 'reloaded without a watchdog')
        self.reloads += 1
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
        require(self.watchdog, 'stopped without a watchdog')
        self.watchdog = False

    def close(self) -> None:
        self._call('close', while_expired=True)
        if self.module.fail_at is None:
            require(not self.watchdog, 'closed with the watchdog armed')
            require(self.task is None, 'closed with a task')
            require(not np.any(np.nan_to_num(self.volts)), 'closed with an output that is not 0 V')
        self.open = False

    def expire(self) -> None:
        """The watchdog expires: 0 V."""
        self.expired = True
        self.volts[:] = 0.0


class Module:
    """The vendor's module, for one test."""

    Clock, DigitalState, HILError = Clock, DigitalState, HILError

    class HIL:
        INFINITE = 2**32 - 1

    def __init__(self, *, left_expired: bool = False) -> None:
        module = self
        self.cards: list[Card] = []
        self.counts = np.zeros(ANALOG, dtype=np.int32)
        self.fail_at: str | None = None
        self.stop_level = 1
        self.enabled: bool | None = None

        class Hil(Module.HIL):
            def __new__(cls, card_type: str, identifier: str) -> Any:  # type: ignore[misc]
                require(card_type == 'q8' and identifier in ('0', '1'), 'no such board')
                require(all(c.identifier != identifier or not c.open for c in module.cards), 'busy')
                if module.fail_at == 'HIL':
                    raise HILError('the board was not found')
                card = Card(module, identifier)
                card.expired = left_expired
                module.cards.append(card)
                return card

        self.HIL = Hil  # type: ignore[misc,assignment]

    def __getattr__(self, name: str) -> Any:
        raise CallError(f'the vendor has no {name}')
