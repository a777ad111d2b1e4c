"""The real stage's life: its boards opened, homed, activated, given up and brought back.

The amplifiers are enabled while currents may flow, following the controller or landing, and at no
other time. What flows then is for :mod:`maglev_hw_bridge.stage`.
"""

from __future__ import annotations

import abc
import contextlib
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge import faults
from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.drivers import Driver, DriverError, WatchdogError, make_driver
from maglev_hw_bridge.encoders import Encoders, HomingError
from maglev_hw_bridge.lift import Lift
from maglev_hw_bridge.memory import Memory
from maglev_hw_bridge.mode import Mode
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing.guard import Guard
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_model.axes import FloatArray
from maglev_model.contract.stage import STOPPED_SINCE, EncoderSample, Fault, StageError
from maglev_model.parameters.plugins import describe_error

_BEFORE = np.array([[-(2**31)], [2**31 - 1]], np.int32)  # no encoder counts both, one after another


class StageLife(abc.ABC):
    """What becomes of the boards of a bridge."""

    def __init__(self, parameters: BridgeParameters, realtime: bool, driver: Driver | None) -> None:
        """Raises StageError when the driver is not there, ParameterError for what cannot be."""
        self.parameters = parameters
        self.sample_time = parameters.sample_time
        self.realtime = realtime
        self.mode = Mode.CLOSED
        self.fault: Fault | None = None
        self._stopped_since = ''  # why, while a fault was latched
        self.why = ''
        self.flying = False  # current flows
        self._lifting = False  # to find out that the stop below is the lower one
        try:
            self.driver = driver or make_driver(parameters, realtime)
        except DriverError as error:
            raise StageError(str(error)) from error
        parameters.check_homing()
        self.encoders = Encoders(parameters)
        self.amplifiers = Amplifiers(parameters)
        self.guard = Guard(parameters)
        self.memory = Memory(parameters)
        self._active = False  # from activation to deactivation, also while the boards are lost
        self._cooling_since = 0.0  # by the monotonic clock [s]
        self._counts = np.zeros(6, dtype=np.int32)
        self._direct, self._quadrature = np.zeros(4), np.zeros(4)
        self._age = 0

    @abc.abstractmethod
    def read(self) -> EncoderSample:
        """The next sample."""

    @abc.abstractmethod
    def write(self, direct_current: Any, quadrature_current: Any) -> None:
        """Currents to follow."""

    @abc.abstractmethod
    def hold(self) -> None:
        """No fresh currents."""

    @abc.abstractmethod
    def land(self, why: str) -> None:
        """Land without a fault."""

    # -- configured --------------------------------------------------------------------------------

    def configure(self) -> None:
        """Claim, open and check the boards, and remember what came before. Raises StageError."""
        if self.mode is not Mode.CLOSED:
            raise StageError(f'cannot be configured: {self.mode.value}')
        self.memory.claim()
        try:
            load, fault = self.memory.recall()
            self._open()
        except Exception as error:
            self.driver.close()
            self.memory.release()
            if isinstance(error, DriverError):
                raise StageError(str(error)) from error
            raise
        self._cool()
        self.amplifiers.arrays.load[:] = np.maximum(load, self.amplifiers.arrays.load)
        self.fault = self.fault or fault
        self.encoders.start(self._counts)
        self._rest(Mode.READY)
        if self.parameters.homing.at_start:
            try:
                self.home(vouched=True)
            except HomingError as error:
                self.close()
                raise StageError(f'homing refused: {error}') from error

    def _open(self) -> None:
        """Open the boards and read what they count. Raises DriverError, whatever a driver does."""
        whose = f"parameter 'driver' is '{self.parameters.driver}', which"
        rows = _BEFORE.repeat(6, axis=1)
        try:
            self.driver.open()
            for row in rows:
                self.driver.counts(row)
        except DriverError:
            raise
        except Exception as error:
            raise DriverError(f'{whose} raised {describe_error(error)}') from error
        if left := np.count_nonzero(np.all(rows == _BEFORE, axis=0)):
            raise DriverError(
                f"{whose} left {left} of the 6 encoders out: 'counts' and 'read' must write what "
                'they count into the array that they are given'
            )
        self._counts[:] = rows[-1]

    def _rest(self, mode: Mode) -> None:
        """No current flows from now on."""
        self.mode, self.flying = mode, False
        self._direct[:] = self._quadrature[:] = 0.0
        self.amplifiers.cut()
        self._cooling_since = time.monotonic()

    def close(self) -> None:
        """Release the boards with no current flowing; may be called twice."""
        self._active = False
        if self.mode is not Mode.CLOSED:
            self._rest(Mode.CLOSED)
            self.driver.close()
            self._keep()
            self.memory.release()

    def _keep(self) -> None:
        """Remember load and fault, a stop since too; where that fails, what is kept is worse."""
        fault = self.fault
        if fault is not None and self._stopped_since:
            since = Fault('stop', self._stopped_since, 'see to that', fault.cut)
            fault = faults.then(fault, since)
        with contextlib.suppress(StageError):
            self.memory.keep(self.amplifiers.arrays.load, fault, active=False)

    def home(self, vouched: bool = False) -> FloatArray:
        """Define the encoders' zeros: the platen rests on its lower stop at its home position.

        That it is not the upper stop is found out by a small lift, unless ``homing.lift`` is 0 or
        the caller has ``vouched`` for it. Returns by how much each zero moved (6,) [m]. Raises
        HomingError, StageError.
        """
        if self.mode is not Mode.READY:
            raise HomingError(f'the boards must be open and the stage inactive: {self.mode.value}')
        lifted = not vouched and self.parameters.homing.lift > 0.0
        if lifted and self.fault is not None and self.fault.kind != 'encoder':
            raise HomingError(f'a fault is latched: {self.fault}')
        if lifted and self._stopped_since:
            raise HomingError(STOPPED_SINCE.format(self._stopped_since))
        readings = np.zeros((self.parameters.homing.samples, 6), dtype=np.int32)
        for row in readings:
            self._peek(row)
            if self.realtime:
                time.sleep(self.sample_time)
        shift = self.encoders.home(readings)
        self.guard.trust()
        if lifted:
            self._prove_lower_stop(self.parameters.homing.lift)
        return shift

    def _prove_lower_stop(self, height: float) -> None:
        """Lift the platen a little, or else it is not homed. Raises HomingError."""
        lift = Lift(self.parameters, height)
        latched, self.fault = self.fault, None
        because = ''
        try:
            self._start()
            self._lifting = True
            lift.fly(self)
        except (StageError, ValueError) as error:
            because = f': {error}'
        finally:
            lifted, self._lifting = self._lifting, False
            self.deactivate()
        if self.fault is not None:
            because = f': {self.fault.reason}'
        self.fault = self.fault or latched
        if lift.fine:
            self.guard.arrays.rises_at = lift.rises_at
            return
        self.encoders.homed = False
        if not lifted:
            raise HomingError(f'the platen cannot be lifted{because}')
        if not because and lift.silent:
            names = ', '.join(ENCODER_NAMES[i] for i in lift.silent)
            because = f'; encoder {names} did not count'
        raise HomingError(
            f'lifted by {height * 1e3:.2f} mm, the platen rose {lift.risen * 1e3:.2f} mm and '
            f'tilted {lift.tilt * 1e3:.2f} mrad{because}. It hangs on its upper stop, '
            'something holds it, or encoders do not count: put it on the lower one, check '
            'the plugs; a machine that was never commissioned, commission first'
        )

    def _peek(self, counts: NDArray[np.int32]) -> None:
        try:
            self.driver.counts(counts)
        except DriverError as error:
            raise self._lose_boards(error) from error

    # -- active ------------------------------------------------------------------------------------

    def activate(self) -> None:
        """Arm the watchdog and enable the amplifiers, no current. Raises StageError."""
        if self.mode is not Mode.READY:
            raise StageError(f'cannot be activated: {self.mode.value}')
        self._start()

    def _start(self) -> None:
        """Start the boards unless something speaks against it. Raises StageError."""
        if self.fault is not None:
            raise StageError(f'a fault is latched: {self.fault}')
        if not self.encoders.homed:
            raise StageError('not homed: home first (~/home)')
        against = self._speaks_against()
        if against:
            raise StageError(against)
        self.memory.keep(self.amplifiers.arrays.load, self.fault, active=True)
        try:
            self.driver.start()
        except DriverError as error:
            raise self._lose_boards(error) from error
        self.guard.forget(self.encoders.arrays.length)
        self._active = True
        self.mode = Mode.FOLLOWING

    def _speaks_against(self) -> str:
        """What speaks against current, by what the boards say now. Raises StageError."""
        if self.mode is Mode.READY:
            self._peek(self._counts)
            self.encoders.decode(self._counts)
            self._cool()
        if self.driver.stop_pressed:
            return 'the emergency stop is pressed'
        beyond = self.encoders.homed and self.encoders.beyond_stops()
        if beyond:
            return f'{beyond}: home first (~/home)'
        hot, wait = self.amplifiers.load, self.amplifiers.cooling_time
        if wait > 0.0:
            return f'the amplifiers are hot, I2t load {hot:.2f}: let them cool for {wait:.1f} s'
        return ''

    def _cool(self) -> None:
        """What the amplifiers have cooled while no sample was taken."""
        now = time.monotonic()
        self.amplifiers.cool(now - self._cooling_since)
        self._cooling_since = now

    def deactivate(self) -> None:
        """Disable the amplifiers and the watchdog; :meth:`land` first.

        Boards that fail meanwhile are lost, which is a fault.
        """
        self._active = False
        if self.mode not in (Mode.FOLLOWING, Mode.LANDING, Mode.DISABLED):
            return
        try:
            self.driver.stop()
        except DriverError as error:
            self._lose_boards(error)
        else:
            self._rest(Mode.READY)
        self._keep()

    # -- boards that fail --------------------------------------------------------------------------

    def _disable(self) -> None:
        """No current, amplifiers disabled, now; boards that refuse are lost."""
        self._rest(Mode.DISABLED)
        try:
            self.driver.disable()
        except DriverError as error:
            self._lose_boards(error)

    def _lose_boards(self, error: DriverError) -> StageError:
        """Give the boards up, then say so: the fault is latched, the error to be raised.

        What was latched before is said too.
        """
        before, landing, flying = self.fault, self.mode is Mode.LANDING, self.flying
        self.driver.close()
        self._rest(Mode.LOST)
        kind = 'watchdog' if isinstance(error, WatchdogError) else 'board'
        what = faults.consequence_of_cut(self.parameters, self.guard) if flying else ''
        fault = Fault(kind, f'{error}{what}', 'see to the boards', True)
        if before is None:
            self.fault, self.why = fault, kind
        elif str(error) not in before.reason:
            self.fault = faults.then(before, fault)
            if landing:
                self.why = kind
        return StageError(str(error))

    # -- coming back -------------------------------------------------------------------------------

    def resume(self) -> None:
        """Follow the controller again after a landing without a fault."""
        if self.mode is Mode.DISABLED and self.fault is None:
            try:
                self.driver.enable()
            except DriverError as error:
                self._lose_boards(error)
                return
            self.mode, self.why = Mode.FOLLOWING, ''

    def reset(self) -> tuple[bool, str]:
        """Clear the latched fault if its cause is gone; whether it was, and what to know.

        An active stage follows the controller again; an inactive one stays without current.
        """
        if self.mode is Mode.LANDING:
            return False, 'still landing: reset when the platen rests'
        if self.fault is None and self.mode is not Mode.DISABLED:
            return False, 'there is no fault'
        if self._stopped_since:
            why, self._stopped_since = self._stopped_since, ''
            return False, STOPPED_SINCE.format(why)
        remaining = self._restart() if self.mode is Mode.LOST else self._remaining()
        if remaining:
            return False, f'the cause is still there: {remaining}'
        cleared, self.fault = self.fault, None
        read_until_now = self.mode is Mode.DISABLED
        self.guard.forget(self.encoders.arrays.length if read_until_now else None)
        self.resume()
        if self.mode is Mode.LOST:
            return False, str(self.fault)
        if not self._active:
            self._keep()
        if cleared is None:
            return True, 'follows the controller again'
        return True, f'cleared: {cleared.reason}'

    def _remaining(self) -> str:
        """What still speaks against clearing a fault, or nothing.

        Encoders that lost their place while another fault was latched leave an inactive stage
        unhomed in place of that: it is homed once that fault is cleared.
        """
        try:
            against = self._speaks_against()
        except StageError as error:
            return str(error)
        lost = faults.lost_counts(self.parameters, self.guard)
        beyond = self.encoders.homed and self.encoders.beyond_stops()
        other = self.mode is Mode.READY and self.fault is not None and self.fault.kind != 'encoder'
        if other and (lost or beyond):
            self.encoders.homed, lost = False, ''
            against = self._speaks_against()
        return against if self.driver.stop_pressed else lost or against

    def _restart(self) -> str:
        """Bring lost boards back: opened, checked and, if active, started; what is wrong.

        They stay lost where something is.
        """
        try:
            self._open()
            self.encoders.doubt_home(self._counts)
            self.mode = Mode.READY
            wrong = self._speaks_against()
            if self._active and not wrong:
                fault, self.fault = self.fault, None
                try:
                    self._start()
                finally:
                    self.fault = fault
        except (DriverError, StageError) as error:
            wrong = str(error)
        if wrong:
            self.driver.close()
            self._rest(Mode.LOST)
        return wrong
