"""Two Quanser Q8 boards through the vendor's HIL module.

The vendor's calls take buffers without types: channels must be uint32, counts int32, volts float64,
digital values int8, digital states int32. A wrong type would be read as something else, without
any error, so all buffers are made once, here.

Reads are paced by the first board's hardware clock: its encoder reader task delivers one sample per
tick, and blocks until there is one. Encoders on the second board are read at the same instant.
"""

from __future__ import annotations

import contextlib
import importlib
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.drivers import CountArray, DriverError, VoltArray, WatchdogError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError

_DIGITAL_LINES = 32
_CLOCK_DRIFT = 5e-4
"""How much slower than this machine's clock the boards' may run; lateness is forgotten as fast."""

_NO_MODULE = (
    "the vendor's Python module 'quanser.hardware' is not installed: it comes with the Quanser SDK"
    ' or QUARC from quanser.com (its folder python/, installed with pip), not from PyPI;'
    ' without boards use driver: emulated'
)


def make(parameters: BridgeParameters, realtime: bool) -> QuanserDriver:
    """The driver on the vendor's module. Raises DriverError when that is missing."""
    if not realtime:
        raise ParameterError(
            "parameter 'mode' is 'lockstep', the boards have a clock of their own: use 'realtime'"
        )
    try:
        hardware = importlib.import_module('quanser.hardware')
    except ImportError as error:
        raise DriverError(_NO_MODULE) from error
    return QuanserDriver(parameters, hardware)


def _channels(values: Sequence[int]) -> NDArray[np.uint32]:
    return np.array(values, dtype=np.uint32)


class _Board:
    """One board: its card, its outputs and its encoders."""

    def __init__(self, parameters: BridgeParameters, number: int) -> None:
        amplifier, encoder = parameters.amplifier, parameters.encoder
        self.identifier = parameters.boards.identifier[number]
        self.card: Any = None
        self.phases = np.flatnonzero(np.array(amplifier.board) == number)
        self.outputs = _channels([amplifier.channel[phase] for phase in self.phases])
        self.volts = np.zeros(len(self.phases))
        self.zeros = np.zeros(len(self.phases))
        self.encoders = np.flatnonzero(np.array(encoder.board) == number)
        self.inputs = _channels([encoder.channel[index] for index in self.encoders])
        self.counts = np.zeros(len(self.encoders), dtype=np.int32)

    def put_out(self, volts: VoltArray) -> None:
        self.card.write_analog(self.outputs, len(self.outputs), volts)


class QuanserDriver:
    """The :class:`~maglev_hw_bridge.drivers.Driver` of the paper's hardware.

    ``hardware`` is the vendor's module or what stands in for it: it holds ``HIL``, ``HILError``,
    ``Clock`` and ``DigitalState``. ``clock`` tells the time that ticks are late by.
    """

    def __init__(
        self,
        parameters: BridgeParameters,
        hardware: Any,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._parameters = parameters
        self._hardware = hardware
        self._clock = clock
        self._boards = [_Board(parameters, number) for number in (0, 1)]
        if not len(self._boards[0].encoders):
            raise ParameterError(
                "parameter 'encoder.board' has no encoder on board 0, whose clock paces the samples"
            )
        self._task: Any = None
        self._running = False
        self._armed: list[_Board] = []
        self._ticks = 0
        self._first_tick = 0.0
        self.late = 0.0
        self.stop_pressed = False
        boards = parameters.boards
        self._stop_channel = _channels([boards.stop_input]) if boards.stop_input >= 0 else None
        self._stop_value = np.zeros(1, dtype=np.int8)
        self._enable_channel = (
            _channels([boards.enable_output]) if boards.enable_output >= 0 else None
        )

    def open(self) -> None:
        """Open both boards, outputs at 0 V; see the protocol."""
        with self._errors('opening the boards'):
            for board in self._boards:
                board.card = self._hardware.HIL(self._parameters.boards.type, board.identifier)
            for board in self._boards:
                self._prepare(board)
            self._set_directions()
            self._read_stop()

    def _prepare(self, board: _Board) -> None:
        card = board.card
        if card.watchdog_is_expired():
            card.watchdog_clear()
        limit = np.full(len(board.outputs), self._parameters.amplifier.voltage_range)
        card.set_analog_output_ranges(board.outputs, len(board.outputs), -limit, limit)
        board.put_out(board.zeros)

    def _set_directions(self) -> None:
        if self._stop_channel is None and self._enable_channel is None:
            return
        none = _channels([])
        inputs = none if self._stop_channel is None else self._stop_channel
        outputs = none if self._enable_channel is None else self._enable_channel
        card = self._boards[0].card
        card.set_digital_directions(inputs, len(inputs), outputs, len(outputs))
        self._enable(False)

    def _enable(self, on: bool) -> None:
        if self._enable_channel is not None:
            value = np.array([on], dtype=np.int8)
            self._boards[0].card.write_digital(self._enable_channel, 1, value)

    def _read_stop(self) -> None:
        if self._stop_channel is not None:
            self._boards[0].card.read_digital(self._stop_channel, 1, self._stop_value)
            self.stop_pressed = int(self._stop_value[0]) == self._parameters.boards.stop_level

    def counts(self, counts: CountArray) -> None:
        """What the encoders count right now; see the protocol."""
        with self._errors('reading the encoders'):
            for board in self._boards:
                self._read_now(board, counts)

    def _read_now(self, board: _Board, counts: CountArray) -> None:
        if len(board.inputs):
            board.card.read_encoder(board.inputs, len(board.inputs), board.counts)
            counts[board.encoders] = board.counts

    def start(self) -> None:
        """Watchdogs armed, amplifiers enabled at zero current, clock running."""
        first = self._boards[0]
        with self._errors('starting the boards'):
            for board in self._boards:
                board.put_out(board.zeros)
                self._arm(board)
            self._enable(True)
            self._task = first.card.task_create_encoder_reader(
                self._parameters.boards.buffer, first.inputs, len(first.inputs)
            )
            first.card.task_start(
                self._task,
                self._hardware.Clock.HARDWARE_CLOCK_0,
                1.0 / self._parameters.sample_time,
                self._hardware.HIL.INFINITE,
            )
            self._running = True
        self._ticks, self.late = 0, 0.0

    def _arm(self, board: _Board) -> None:
        """0 V and, which a Q8 requires with that, tristate digital lines on expiry; then start."""
        lines = _channels(range(_DIGITAL_LINES))
        tristate = np.full(_DIGITAL_LINES, self._hardware.DigitalState.TRISTATE, dtype=np.int32)
        card = board.card
        card.watchdog_set_analog_expiration_state(board.outputs, len(board.outputs), board.zeros)
        card.watchdog_set_digital_expiration_state(lines, len(lines), tristate)
        card.watchdog_start(self._parameters.boards.watchdog)
        self._armed.append(board)

    def read(self, counts: CountArray) -> None:
        """The next tick's counts; see the protocol."""
        first, second = self._boards
        try:
            first.card.task_read_encoder(self._task, 1, first.counts)
            counts[first.encoders] = first.counts
            self._read_now(second, counts)
            self._read_stop()
        except self._hardware.HILError as error:
            raise self._explain('reading a sample', error) from error
        self._keep_time()

    def _keep_time(self) -> None:
        """How far this sample is behind regular ticks, the earliest one on time."""
        now = self._clock()
        due = self._first_tick + self._ticks * self._parameters.sample_time
        if self._ticks == 0 or now < due:
            self._first_tick += now - due
            due = now
        self.late = now - due
        self._first_tick += _CLOCK_DRIFT * self._parameters.sample_time
        self._ticks += 1

    def write(self, volts: VoltArray) -> None:
        """Put out the volts and reload both watchdogs; raises WatchdogError when one expired."""
        first, second = self._boards
        np.take(volts, first.phases, out=first.volts)
        np.take(volts, second.phases, out=second.volts)
        try:
            in_time = first.card.watchdog_reload()
            in_time = second.card.watchdog_reload() and in_time
            if not in_time:
                raise WatchdogError(self._expired())
            first.put_out(first.volts)
            second.put_out(second.volts)
        except self._hardware.HILError as error:
            raise self._explain('putting out a sample', error) from error

    def _expired(self) -> str:
        return (
            f"the boards' watchdog expired: no sample for {self._parameters.boards.watchdog:g} s; "
            'free the machine of other load, or raise boards.watchdog'
        )

    def stop(self) -> None:
        """0 V, watchdogs and clock stopped; an expired watchdog is cleared."""
        task, self._task = self._task, None
        running, self._running = self._running, False
        armed, self._armed = self._armed, []
        with self._errors('stopping the boards'), contextlib.ExitStack() as last:
            for board in armed:
                last.callback(self._disarm, board)
            if task is not None:
                last.callback(self._boards[0].card.task_delete, task)
            if running:
                last.callback(self._boards[0].card.task_stop, task)

    def _disarm(self, board: _Board) -> None:
        card = board.card
        try:
            if card.watchdog_is_expired():
                card.watchdog_clear()
            board.put_out(board.zeros)
            if board is self._boards[0]:
                self._enable(False)
        finally:
            card.watchdog_stop()

    def close(self) -> None:
        """Outputs at 0 V, everything released, whatever state the boards are in."""
        with contextlib.suppress(DriverError):
            self.stop()
        for board in self._boards:
            card, board.card = board.card, None
            if card is None:
                continue
            with contextlib.suppress(self._hardware.HILError):
                card.write_analog(board.outputs, len(board.outputs), board.zeros)
            with contextlib.suppress(self._hardware.HILError):
                card.close()

    @contextlib.contextmanager
    def _errors(self, doing: str) -> Any:
        try:
            yield
        except self._hardware.HILError as error:
            raise self._explain(doing, error) from error

    def _explain(self, doing: str, error: Exception) -> DriverError:
        if self._armed and self._any_expired():
            return WatchdogError(self._expired())
        message = getattr(error, 'get_error_message', lambda: str(error))()
        return DriverError(
            f'{doing} failed: {message}; check that both {self._parameters.boards.type} boards '
            f'({", ".join(self._parameters.boards.identifier)}) are there and free'
        )

    def _any_expired(self) -> bool:
        try:
            return any(board.card.watchdog_is_expired() for board in self._armed)
        except self._hardware.HILError:
            return False
