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
from collections.abc import Callable, Iterator
from typing import Any

from maglev_hw_bridge.board import Board, Undisturbed, attempt, unbroken
from maglev_hw_bridge.drivers import CountArray, DriverError, VoltArray, WatchdogError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError

_CLOCK_DRIFT = 5e-4
"""How much slower than this machine's clock the boards' may run; lateness is forgotten as fast."""

_QUARTERS = 5
"""How long a board that is not safe is held on to, in quarters of the watchdog's time."""

_NO_MODULE = (
    "the vendor's Python module 'quanser.hardware' cannot be imported: {}; it and the library that "
    'it loads come with the Quanser SDK or QUARC from quanser.com (its folder python/, installed '
    'with pip), not from PyPI; without boards use driver: emulated'
)


def make(parameters: BridgeParameters, realtime: bool) -> QuanserDriver:
    """The driver on the vendor's module. Raises DriverError when that is missing."""
    if not realtime:
        raise ParameterError(
            "parameter 'mode' is 'lockstep', the boards have a clock of their own: use 'realtime'"
        )
    try:
        hardware = importlib.import_module('quanser.hardware')
    except (ImportError, OSError) as error:  # it loads the vendor's library at once
        raise DriverError(_NO_MODULE.format(error)) from error
    return QuanserDriver(parameters, hardware)


class QuanserDriver:
    """The :class:`~maglev_hw_bridge.drivers.Driver` of the paper's hardware.

    ``hardware`` is the vendor's module or what stands in for it: it holds ``HIL``, ``Clock`` and
    ``DigitalState``. ``clock`` tells the time that ticks are late by; ``sleep`` waits for the
    boards, when they do not do what they are told at the end.
    """

    def __init__(
        self,
        parameters: BridgeParameters,
        hardware: Any,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._parameters = parameters
        self._hardware = hardware
        self._clock, self._sleep = clock, sleep
        self._boards = [Board(parameters, number) for number in (0, 1)]
        if not len(self._boards[0].encoders):
            raise ParameterError(
                "parameter 'encoder.board' has no encoder on board 0, whose clock paces the samples"
            )
        self._task: Any = None
        self._ticks = 0
        self._first_tick = 0.0
        self.late = 0.0
        self.stop_pressed = False
        self._undisturbed = Undisturbed()

    def open(self) -> None:
        """Open both boards, no current; see the protocol."""
        with self._errors('opening the boards'):
            for board in self._boards:
                board.card = self._hardware.HIL(self._parameters.boards.type, board.identifier)
            for board in self._boards:
                board.prepare()
            self.stop_pressed = self._boards[0].stop_pressed()

    def counts(self, counts: CountArray) -> None:
        """What the encoders count right now; see the protocol."""
        with self._errors('reading the encoders'):
            for board in self._boards:
                board.read_now(counts)
            self.stop_pressed = self._boards[0].stop_pressed()

    def start(self) -> None:
        """Watchdogs armed, clock running, then amplifiers enabled at zero current."""
        first = self._boards[0]
        with self._errors('starting the boards'):
            for board in self._boards:
                board.rest()
                board.arm(self._hardware.DigitalState)
            self._task = first.ask(
                'task_create_encoder_reader',
                self._parameters.kept_samples,
                first.inputs,
                len(first.inputs),
            )
            first.ask(
                'task_start',
                self._task,
                self._hardware.Clock.HARDWARE_CLOCK_0,
                1.0 / self._parameters.sample_time,
                self._hardware.HIL.INFINITE,
            )
            first.enable(True)
        self._ticks, self.late = 0, 0.0

    def read(self, counts: CountArray) -> None:
        """The next tick's counts; see the protocol."""
        first, second = self._boards
        try:
            with self._undisturbed:
                if first.ask('task_read_encoder', self._task, 1, first.counts) != 1:
                    raise DriverError("the first board's sample clock has stopped")
                counts[first.encoders] = first.counts
                second.read_now(counts)
                self.stop_pressed = first.stop_pressed()
        except Exception as error:
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
        volts.take(first.phases, out=first.volts)
        volts.take(second.phases, out=second.volts)
        try:
            in_time = first.ask('watchdog_reload')
            in_time = second.ask('watchdog_reload') and in_time
            if not in_time:
                raise self._expired()
            first.put_out(first.volts)
            second.put_out(second.volts)
        except Exception as error:
            raise self._explain('putting out a sample', error) from error

    def _expired(self) -> WatchdogError:
        return WatchdogError(
            f"the boards' watchdog expired: no sample for {self._parameters.boards.watchdog:g} s; "
            'free the machine of other load, or raise boards.watchdog',
            [board.identifier for board in self._boards if not board.expired()],
        )

    def disable(self) -> None:
        """No current, amplifiers disabled; see the protocol."""
        with self._errors('disabling the amplifiers'):
            self._raise_first([p for board in self._boards for p in board.make_safe(clear=False)])

    def enable(self) -> None:
        """Amplifiers enabled, without current."""
        with self._errors('enabling the amplifiers'):
            for board in self._boards:
                board.rest()
            self._boards[0].enable(True)

    def stop(self) -> None:
        """No current, amplifiers disabled, clock stopped, and watchdogs where that succeeded."""
        with self._errors('stopping the boards'):
            self._raise_first(self._make_safe())

    def close(self) -> None:
        """No current, everything released, whatever state the boards are in."""
        with unbroken(), Undisturbed():
            self._make_safe()
            for board in self._boards:
                if not board.armed:
                    board.release()
            self._outlast_watchdogs()
            for board in self._boards:
                board.release()

    def _make_safe(self) -> list[Exception]:
        """All that ends the current on all boards, whatever fails; what did."""
        problems = [problem for board in self._boards for problem in board.make_safe()]
        task, self._task = self._task, None
        if task is not None:
            problems += attempt(self._boards[0].ask, 'task_stop', task)
            problems += attempt(self._boards[0].ask, 'task_delete', task)
        for board in self._boards:
            problems += board.disarm()
        return problems

    def _outlast_watchdogs(self) -> None:
        """Hold on to boards that are not safe until their watchdogs must have expired."""
        for _ in range(_QUARTERS):
            left = [board for board in self._boards if board.armed and not board.expired()]
            if not left:
                return
            self._sleep(0.25 * self._parameters.boards.watchdog)
            for board in left:
                board.make_safe(clear=False)
                board.disarm()

    def _raise_first(self, problems: list[Exception]) -> None:
        if problems:
            raise problems[0]

    @contextlib.contextmanager
    def _errors(self, doing: str) -> Iterator[None]:
        """Whatever is raised is explained, as a DriverError; signals interrupt no call."""
        with Undisturbed():
            try:
                yield
            except Exception as error:
                raise self._explain(doing, error) from error

    def _explain(self, doing: str, error: Exception) -> DriverError:
        if isinstance(error, WatchdogError):
            return error
        if any(board.armed and board.expired() for board in self._boards):
            return self._expired()
        return DriverError(
            f'{doing} failed: {_in_words(error)}; check that both {self._parameters.boards.type} '
            f'boards ({", ".join(self._parameters.boards.identifier)}) are there and free'
        )


def _in_words(error: Exception) -> str:
    try:
        return str(error.get_error_message())  # type: ignore[attr-defined]
    except Exception:
        return str(error) or repr(error)
