"""One Quanser board: what the driver asks of it, call by call, and how it is made safe.

Safe is: amplifiers disabled, outputs at the volts that make no current, watchdog stopped, in this
order, and the last only after the others have succeeded. A board that cannot be brought there keeps
its watchdog, which then does what the board could not be told to.
"""

from __future__ import annotations

import contextlib
import ctypes
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.drivers import CountArray, VoltArray
from maglev_hw_bridge.parameters import BridgeParameters

_DIGITAL_LINES = 32
_INTERRUPTED = 35  # the vendor's QERR_INTERRUPTED, raised negative
_INTERRUPTIONS = 5  # of one call that are borne
_ATTEMPTS = 3  # at what makes a board safe

_SIGNALS = (
    signal.SIGHUP,
    signal.SIGINT,
    signal.SIGQUIT,
    signal.SIGTERM,
    signal.SIGTSTP,
    signal.SIGALRM,
    signal.SIGCHLD,
    signal.SIGUSR1,
    signal.SIGUSR2,
    signal.SIGWINCH,
)


ENDING = (signal.SIGHUP, signal.SIGINT, signal.SIGQUIT, signal.SIGTERM, signal.SIGTSTP)

# Python's own pthread_sigmask makes a set of enums of each mask: 8 µs more, twice a sample
_LIBC = ctypes.PyDLL(None)
_Mask = ctypes.c_ubyte * 128  # a sigset_t, as large as any
_BLOCKED = _Mask()
_SIG_BLOCK, _SIG_SETMASK = int(signal.SIG_BLOCK), int(signal.SIG_SETMASK)
for _one in _SIGNALS:
    _LIBC.sigaddset(_BLOCKED, int(_one))


class Undisturbed:
    """Signals go to other threads, or wait: they interrupt no call inside ``with`` one of these.

    Where another thread takes one, what Python does about it is done in the main thread all the
    same, also in here: :func:`unbroken` is what no exception of a signal breaks.
    """

    def __init__(self) -> None:
        self._before = _Mask()

    def __enter__(self) -> None:
        _LIBC.pthread_sigmask(_SIG_BLOCK, _BLOCKED, self._before)

    def __exit__(self, *_: object) -> None:
        _LIBC.pthread_sigmask(_SIG_SETMASK, self._before, None)


@contextlib.contextmanager
def unbroken() -> Iterator[None]:
    """What a signal does that ends or stops the process, it does afterwards; in the main thread."""
    if threading.current_thread() is not threading.main_thread():  # where no signal is handled
        yield
        return
    caught: list[int] = []

    def catch(number: int, _frame: object) -> None:
        caught.append(number)

    before = {number: signal.signal(number, catch) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for noted in caught:
            signal.raise_signal(noted)


def channels(values: Sequence[int]) -> NDArray[np.uint32]:
    """Channel numbers as the vendor's calls want them."""
    return np.array(values, dtype=np.uint32)


def attempt(action: Callable[..., Any], *arguments: Any) -> list[Exception]:
    """Try it some times, whatever it raises; the last error, or nothing."""
    for _ in range(_ATTEMPTS):
        try:
            action(*arguments)
        except Exception as error:
            last = error
        else:
            return []
    return [last]


class Board:
    """One board: its card, its outputs, its encoders; the first has stop and enable lines too."""

    def __init__(self, parameters: BridgeParameters, number: int) -> None:
        amplifier, encoder, boards = parameters.amplifier, parameters.encoder, parameters.boards
        self.identifier = boards.identifier[number]
        self.card: Any = None
        self.armed = False  # its watchdog runs
        self.calm = True  # it is known to be safe
        self._watchdog = boards.watchdog
        self.phases = np.flatnonzero(np.array(amplifier.board) == number)
        self.outputs = channels([amplifier.channel[phase] for phase in self.phases])
        self.volts = np.zeros(len(self.phases))
        self._rest = np.array(amplifier.offset)[self.phases]
        self._limit = np.full(len(self.outputs), amplifier.voltage_range)
        no_current = boards.analog_expiry == 'no_current'
        self._expiry = self._rest if no_current else np.zeros(len(self.outputs))
        self.encoders = np.flatnonzero(np.array(encoder.board) == number)
        self.inputs = channels([encoder.channel[index] for index in self.encoders])
        self.counts = np.zeros(len(self.encoders), dtype=np.int32)
        stop = [boards.stop_input] if number == 0 and boards.stop_input >= 0 else []
        enable = [boards.enable_output] if number == 0 and boards.enable_output >= 0 else []
        self._stop_line, self._enable_line = channels(stop), channels(enable)
        self._stop_level, self._stop_value = boards.stop_level, np.zeros(1, dtype=np.int8)
        on = boards.enable_level
        self._enable_value = np.array([[1 - on], [on]], dtype=np.int8)
        self._off_when_open = boards.open_level != on
        self._digital_expiry = boards.digital_expiry.upper()

    def ask(self, call: str, *arguments: Any) -> Any:
        """What a call of the vendor returns; one that a signal interrupts is made again."""
        function = getattr(self.card, call)
        for _ in range(_INTERRUPTIONS):
            try:
                return function(*arguments)
            except Exception as error:
                if abs(getattr(error, 'error_code', 0)) != _INTERRUPTED:
                    raise
        return function(*arguments)

    # -- getting ready -----------------------------------------------------------------------------

    def prepare(self) -> None:
        """Ranges and directions set; amplifiers disabled, no current."""
        self._clear()
        self._set_directions()
        self.ask(
            'set_analog_output_ranges', self.outputs, len(self.outputs), -self._limit, self._limit
        )
        self.rest()

    def _clear(self) -> bool:
        """Allow access after the watchdog expired, which drives the enable line again."""
        expired = bool(self.ask('watchdog_is_expired'))
        if expired:
            self.ask('watchdog_clear')
        return expired

    def _set_directions(self) -> None:
        inputs, outputs = self._stop_line, self._enable_line
        if not (len(inputs) or len(outputs)):
            return
        with contextlib.suppress(Exception):  # so that the line is off from when it is driven
            self.enable(False)
        self.ask('set_digital_directions', inputs, len(inputs), outputs, len(outputs))
        self.enable(False)

    def arm(self, states: Any) -> None:
        """Start the watchdog; ``states`` are the vendor's names of digital states."""
        lines = channels(range(_DIGITAL_LINES))
        state = getattr(states, self._digital_expiry)
        digital = np.full(_DIGITAL_LINES, state, dtype=np.int32)
        outputs = self.outputs
        self.ask('watchdog_set_analog_expiration_state', outputs, len(outputs), self._expiry)
        self.ask('watchdog_set_digital_expiration_state', lines, len(lines), digital)
        self.ask('watchdog_start', self._watchdog)
        self.armed = True

    # -- samples -----------------------------------------------------------------------------------

    def put_out(self, volts: VoltArray) -> None:
        """Volts of its outputs."""
        self.ask('write_analog', self.outputs, len(self.outputs), volts)

    def rest(self) -> None:
        """The volts that make no current."""
        self.put_out(self._rest)

    def enable(self, on: bool) -> None:
        """Enable the amplifiers, or disable them, where this board can."""
        if len(self._enable_line):
            self.ask('write_digital', self._enable_line, 1, self._enable_value[int(on)])

    def read_now(self, counts: CountArray) -> None:
        """Its encoders' counts, without waiting, into ``counts`` (6,)."""
        if len(self.inputs):
            self.ask('read_encoder', self.inputs, len(self.inputs), self.counts)
            counts[self.encoders] = self.counts

    def stop_pressed(self) -> bool:
        """Whether its stop input says so."""
        if not len(self._stop_line):
            return False
        self.ask('read_digital', self._stop_line, 1, self._stop_value)
        return int(self._stop_value[0]) == self._stop_level

    def expired(self) -> bool:
        """Whether its watchdog is seen to have expired."""
        try:
            return bool(self.ask('watchdog_is_expired'))
        except Exception:
            return False

    # -- the end -----------------------------------------------------------------------------------

    def make_safe(self, clear: bool = True) -> list[Exception]:
        """Amplifiers disabled and no current, each tried by itself; what failed.

        ``clear``: also where the watchdog has expired already. A board that was cleared and is not
        safe then gets its watchdog back.
        """
        if self.card is None:
            return []
        cleared: list[bool] = []
        if clear:
            attempt(lambda: cleared.append(self._clear()))
        problems = attempt(self._disable) + attempt(self.rest)
        self.calm = not problems
        if problems and any(cleared):
            self.armed |= not attempt(self.ask, 'watchdog_start', self._watchdog)
        return problems

    def _disable(self) -> None:
        """Turn the enable line off or, where that fails, let go of it."""
        try:
            self.enable(False)
        except Exception:
            if not self._off_when_open:
                raise
            lines = channels([*self._stop_line, *self._enable_line])
            self.ask('set_digital_directions', lines, len(lines), channels([]), 0)

    def disarm(self) -> list[Exception]:
        """Stop the watchdog of a board that is safe."""
        if not (self.armed and self.calm):
            return []
        problems = attempt(self.ask, 'watchdog_stop')
        self.armed = bool(problems)
        return problems

    def release(self) -> None:
        """Give the card back, whatever it says."""
        if self.card is not None:
            attempt(self.ask, 'close')
        self.card, self.armed, self.calm = None, False, True
