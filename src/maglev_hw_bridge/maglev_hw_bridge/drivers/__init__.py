"""Drivers: what moves counts and volts between the bridge and the boards.

A driver is one module in this package with a function ``make(parameters, realtime)`` that returns
a :class:`Driver`; the parameter ``driver`` names it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError
from maglev_model.parameters.plugins import plugin_function

CountArray = NDArray[np.int32]
VoltArray = NDArray[np.float64]


_NEEDED = (
    *('late', 'stop_pressed'),
    *('open', 'counts', 'start', 'read', 'write', 'disable', 'enable', 'stop', 'close'),
)


class DriverError(RuntimeError):
    """The boards cannot be used (any more); the message says why and what to do."""


class WatchdogError(DriverError):
    """A board's watchdog expired: it went to its expiry states and refuses everything.

    ``running``: the boards whose watchdog had not.
    """

    def __init__(self, message: str, running: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.running = running


class SampledDriver(Protocol):
    """What goes on sample by sample; every call may raise DriverError."""

    stop_pressed: bool
    """Whether the emergency stop input was active when the boards were read last."""

    def start(self) -> None:
        """Arm the watchdog, start the clock that paces :meth:`read`, enable the amplifiers."""
        ...

    def read(self, counts: CountArray) -> None:
        """Wait for the next sample and write what the six encoders count into ``counts`` (6,)."""
        ...

    def write(self, volts: VoltArray) -> None:
        """Put out the volts of the twelve phases, shape (12,), and reload the watchdog."""
        ...

    def stop(self) -> None:
        """No current, amplifiers disabled; then, only where that succeeded, watchdog stopped."""
        ...


class Driver(SampledDriver, Protocol):
    """What the bridge asks of the boards, in this order; every call may raise DriverError.

    :meth:`open`, :meth:`counts` any time, :meth:`start`, then :meth:`read` and :meth:`write` once a
    sample, :meth:`disable` and :meth:`enable` between two samples, :meth:`stop`, :meth:`close`.
    After :meth:`stop` it may be started again. No current is what ``amplifier.offset`` says, which
    need not be 0 V.
    """

    late: float
    """By how much the sample read last was behind its tick [s].

    The first board's encoders are to be those of the tick, the other's may be read that much later.
    """

    def open(self) -> None:
        """Open and check the boards: no current, amplifiers disabled."""
        ...

    def counts(self, counts: CountArray) -> None:
        """Write what the six encoders count right now, without waiting, into ``counts`` (6,)."""
        ...

    def disable(self) -> None:
        """No current, amplifiers disabled; samples go on."""
        ...

    def enable(self) -> None:
        """Amplifiers enabled, without current."""
        ...

    def close(self) -> None:
        """As stop, and release the boards; may be called twice and must not raise."""
        ...


@runtime_checkable
class Truthful(Protocol):
    """A driver of boards that are not real also tells what is behind a sample."""

    def truth(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The truth at the sample read last.

        x1..x10 (10,); i_d, then i_q flowing (8,) [A]; and how much more than whole counts the
        encoders' scales have (6,) [m].
        """
        ...


def make_driver(parameters: BridgeParameters, realtime: bool) -> Driver:
    """The driver that ``driver`` names.

    Raises ParameterError when there is none of that name, or what a driver needs is missing from
    it: that is not to be found out by a landing.
    """
    make = plugin_function('driver', parameters.driver, 'make', __name__)
    driver: Driver = make(parameters, realtime)
    missing = [name for name in _NEEDED if not hasattr(driver, name)]
    if missing:
        raise ParameterError(
            f"parameter 'driver' is '{parameters.driver}', a driver without {', '.join(missing)}"
        )
    return driver
