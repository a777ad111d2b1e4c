"""The real stage behind the stage contract: encoders, commutation, amplifiers, boards and faults.

While boards and amplifiers are sound and at least one gap encoder tells where the platen is, every
fault ends in a landing that the bridge makes by itself; otherwise the current is cut. Either is
latched until :meth:`reset`.
"""

from __future__ import annotations

import contextlib
import enum
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_hw_bridge import amplifiers, faults, guard
from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.drivers import Driver, DriverError, Truthful, WatchdogError, make_driver
from maglev_hw_bridge.encoders import Encoders, HomingError
from maglev_hw_bridge.guard import Guard
from maglev_hw_bridge.landing import Landing
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.stage import EncoderSample, Fault, StageError, Truth, motor_currents

FloatArray = NDArray[np.float64]

_ON_THE_STOP = 2e-4  # this near the lower stop the platen rests [m]


class Mode(enum.Enum):
    """What the bridge does."""

    CLOSED = 'closed'
    READY = 'boards open, outputs at 0 V'
    FOLLOWING = 'following the controller'
    LANDING = 'landing by itself'
    DISABLED = 'no current'
    LOST = 'the boards are lost'


class BridgeStage:
    """The :class:`~maglev_model.stage.Stage` on boards, one sample per :meth:`read`."""

    paced = True
    restartable = True

    def __init__(
        self,
        parameters: BridgeParameters | None = None,
        *,
        realtime: bool = False,
        driver: Driver | None = None,
    ) -> None:
        """Raises StageError when the driver is not there, ParameterError when there is none."""
        self.parameters = parameters or BridgeParameters()
        self.sample_time = self.parameters.sample_time
        self.realtime = realtime
        self.mode = Mode.CLOSED
        self.fault: Fault | None = None
        self.why = ''
        self.late_ticks = 0
        try:
            self.driver = driver or make_driver(self.parameters, realtime)
        except DriverError as error:
            raise StageError(str(error)) from error
        self._all_knowing = self.driver if isinstance(self.driver, Truthful) else None
        self.encoders = Encoders(self.parameters)
        self.amplifiers = Amplifiers(self.parameters)
        self.guard = Guard(self.parameters)
        self.landing = Landing(self.parameters)
        self._counts = np.zeros(6, dtype=np.int32)
        self._zero = np.zeros(4)
        self._direct, self._quadrature = np.zeros(4), np.zeros(4)
        self.flying = False  # current flows
        self._age = 0  # samples since the last fresh currents
        self._lower_stop = self.parameters.machine.gap_max
        self._stale_samples = round(self.parameters.fault.stale / self.parameters.sample_time)
        self._warm_up()

    @classmethod
    def ready(cls, parameters: BridgeParameters, *, realtime: bool = False) -> BridgeStage:
        """A stage that is configured and active. Raises StageError, ParameterError."""
        stage = cls(parameters, realtime=realtime)
        stage.configure()
        stage.activate()
        return stage

    def _warm_up(self) -> None:
        """Compile, or load what was compiled, before a sample asks for it."""
        y, rate = self._lower_stop, np.zeros(5)
        for _ in range(3):
            self.guard.watch(np.array([y, y, y, y, 0.0, 0.0]), self.amplifiers.arrays.current, True)
        self.landing.begin(self.guard.arrays.position, rate)
        self.landing.step(self.guard.arrays.position, rate, rate)
        self.encoders.decode(self._counts)
        self.amplifiers.drive(self._zero, self._zero, 0.0, 0.0)
        faults.consequence_of_cut(self.parameters, self.guard)
        self.guard.forget()

    # -- states ------------------------------------------------------------------------------------

    def configure(self) -> None:
        """Open and check the boards, read the encoders, home when that is wanted at the start."""
        try:
            self.driver.open()
            self.driver.counts(self._counts)
        except DriverError as error:
            self.driver.close()
            raise StageError(str(error)) from error
        self.encoders.start(self._counts)
        self.mode = Mode.READY
        if self.parameters.homing.at_start:
            try:
                self.home()
            except HomingError as error:
                self.close()
                raise StageError(f'homing refused: {error}') from error

    def activate(self) -> None:
        """Arm the watchdog and enable the amplifiers at zero current. Raises StageError."""
        if self.mode is not Mode.READY:
            raise StageError(f'cannot be activated: {self.mode.value}')
        self._check_encoders()
        with self._or_drop_boards():
            self.driver.start()
        self.amplifiers.cut()
        self.guard.forget()
        self.flying, self._age = False, 0
        self.mode = Mode.FOLLOWING if self.fault is None else Mode.DISABLED

    def _check_encoders(self) -> None:
        """Refuse encoders that read what the stops do not let the platen be."""
        self._peek(self._counts)
        self.encoders.decode(self._counts)
        beyond = self.encoders.beyond_stops()
        if beyond:
            raise StageError(f'{beyond}: home first (~/home)')

    def deactivate(self) -> None:
        """Disable the amplifiers and the watchdog; :meth:`land` first. Raises StageError."""
        if self.mode not in (Mode.FOLLOWING, Mode.LANDING, Mode.DISABLED):
            return
        self.amplifiers.cut()
        self.flying = False
        with self._or_drop_boards():
            self.driver.stop()
        self.mode = Mode.READY

    def close(self) -> None:
        """Release the boards with outputs at 0 V; may be called twice."""
        self.flying = False
        if self.mode is not Mode.CLOSED:
            self.mode = Mode.CLOSED
            self.amplifiers.cut()
            self.driver.close()

    def home(self) -> FloatArray:
        """Define the encoders' zeros: the platen rests at its home position.

        Returns by how much each zero moved (6,) [m]. Raises HomingError, StageError.
        """
        if self.mode is not Mode.READY:
            raise HomingError(f'the boards must be open and the stage inactive: {self.mode.value}')
        readings = np.zeros((self.parameters.homing.samples, 6), dtype=np.int32)
        for row in readings:
            self._peek(row)
            if self.realtime:
                time.sleep(self.parameters.sample_time)
        shift = self.encoders.home(readings)
        self.guard.trust()
        return shift

    def _peek(self, counts: NDArray[np.int32]) -> None:
        with self._or_drop_boards():
            self.driver.counts(counts)

    # -- samples -----------------------------------------------------------------------------------

    @property
    def late(self) -> float:
        """How late the sample read last was, by the boards' clock [s]."""
        return self.driver.late

    def truth(self) -> Truth | None:
        """The true state of the sample read last; None unless the boards are emulated."""
        if self._all_knowing is None:
            return None
        state, current = self._all_knowing.truth()
        load: FloatArray = self.amplifiers.arrays.load.reshape(4, 3).max(axis=1)
        return Truth(state, current[:4], current[4:], load)

    def read(self) -> EncoderSample:
        """The next sample; waits for the boards' clock. Raises StageError when they are lost."""
        if self.mode in (Mode.CLOSED, Mode.READY, Mode.LOST):
            raise StageError(f'no sample: {self.mode.value}')
        try:
            self.driver.read(self._counts)
        except DriverError as error:
            raise self._lose_boards(error) from error
        length = self.encoders.decode(self._counts)
        code, index = self.guard.watch(length, self.amplifiers.arrays.current, self.flying)
        if code != guard.FINE:
            self._sensing_fault(code, index)
        if self.driver.stop_pressed:
            self._raise_fault('stop', 'the emergency stop is pressed', 'release it')
        if self.driver.late > 0.5 * self.parameters.sample_time:
            self._late()
        return EncoderSample(length[:4].copy(), length.item(4), length.item(5))

    def write(self, direct_current: Any, quadrature_current: Any) -> None:
        """Currents of motors 1..4 [A], (4,) each, fresh from the controller.

        Raises ValueError when a shape is wrong or a current is not finite or too large (the bridge
        then lands), StageError when the boards are lost.
        """
        i_d = motor_currents('direct_current', direct_current)
        i_q = motor_currents('quadrature_current', quadrature_current)
        self._age = 0
        refused = ''
        if self.mode is Mode.FOLLOWING:
            refused = self._follow(i_d, i_q)
        elif not (np.all(np.isfinite(i_d)) and np.all(np.isfinite(i_q))):
            refused = 'currents must be finite'
        self._put_out()
        if refused:
            raise ValueError(refused)

    def hold(self) -> None:
        """No fresh currents for this sample: the last ones stay, for a while. Raises StageError."""
        self._age += 1
        if self.mode is Mode.FOLLOWING:
            if self.flying and self._age >= self._stale_samples:
                self._raise_fault('stale', *faults.stale_fault(self._age * self.sample_time))
            else:
                self._follow(self._direct, self._quadrature)
        self._put_out()

    def _follow(self, i_d: FloatArray, i_q: FloatArray) -> str:
        """Drive the amplifiers as commanded; returns why a command was refused."""
        x, z = self.guard.arrays.believed[4], self.guard.arrays.believed[5]
        code, index = self.amplifiers.drive(i_d, i_q, x, z)
        if code in (amplifiers.FINE, amplifiers.SPENT):
            self._direct[:], self._quadrature[:] = i_d, i_q
            self.flying = bool(np.any(i_d) or np.any(i_q))
        if code == amplifiers.FINE:
            return ''
        reason, remedy = faults.command_fault(code, index, i_d, i_q, self.amplifiers)
        self._raise_fault('current', reason, remedy)
        return '' if code == amplifiers.SPENT else reason

    def _put_out(self) -> None:
        if self.mode is Mode.LANDING:
            self._descend()
        if self.mode in (Mode.FOLLOWING, Mode.LANDING, Mode.DISABLED):
            if self.mode is Mode.DISABLED:
                self.amplifiers.drive(self._zero, self._zero, 0.0, 0.0)
            try:
                self.driver.write(self.amplifiers.volts)
            except DriverError as error:
                raise self._lose_boards(error) from error

    def _descend(self) -> None:
        state = self.guard.arrays
        if self.landing.step(state.position, state.rate, state.disturbance):
            self._disable()
            return
        x, z = state.believed[4], state.believed[5]
        i_d, i_q = self.landing.direct_current, self.landing.quadrature_current
        code, _ = self.amplifiers.drive(i_d, i_q, x, z)
        if code not in (amplifiers.FINE, amplifiers.SPENT):
            self._disable()

    # -- faults ------------------------------------------------------------------------------------

    def land(self, why: str) -> None:
        """Land without a fault; the mode is DISABLED when it is done."""
        if self.mode is Mode.FOLLOWING:
            self.why = why
            self._begin_landing()

    def stop(self, why: str = 'emergency stop') -> None:
        """Latch a fault with that reason; lands while everything needed for that is sound."""
        self._raise_fault('stop', why, 'see to what made it necessary')

    def resume(self) -> None:
        """Follow the controller again after a landing without a fault."""
        if self.mode is Mode.DISABLED and self.fault is None:
            self.mode, self.why, self._age = Mode.FOLLOWING, '', 0

    def reset(self) -> tuple[bool, str]:
        """Clear the latched fault if its cause is gone; whether it was, and what to know."""
        if self.fault is None:
            resumed = self.mode is Mode.DISABLED
            self.resume()
            return resumed, 'follows the controller again' if resumed else 'there is no fault'
        if self.mode is Mode.LANDING:
            return False, 'still landing: reset when the platen rests'
        if self.mode is Mode.LOST:
            remaining = self._restart()
        else:
            pressed = self.driver.stop_pressed
            remaining = faults.remaining_cause(
                self.parameters, pressed, self.guard, self.amplifiers
            )
        if remaining:
            return False, f'the cause is still there: {remaining}'
        cleared, self.fault = self.fault, None
        self._direct[:] = self._quadrature[:] = 0.0
        self.guard.forget()
        self.resume()
        return True, f'cleared: {cleared.reason}'

    def _restart(self) -> str:
        """Bring lost boards back: closed, opened, checked, started; what went wrong."""
        self.driver.close()
        self.mode = Mode.CLOSED
        homed, total = self.encoders.homed, self.encoders.arrays.total.copy()
        try:
            self.driver.open()
            self.driver.counts(self._counts)
            self.encoders.decode(self._counts)
            self.mode = Mode.READY
            self.activate()
        except (DriverError, StageError) as error:
            self.driver.close()
            self.mode = Mode.LOST
            return str(error)
        self.encoders.homed = homed and bool(np.any(self.encoders.arrays.total) or not total.any())
        return ''

    def _raise_fault(self, kind: str, reason: str, remedy: str, cut: bool = False) -> None:
        if self.fault is not None and not (cut and self.mode is Mode.LANDING):
            return
        if cut and self.flying:
            reason += faults.consequence_of_cut(self.parameters, self.guard)
        self.fault = Fault(kind, reason, remedy, cut)
        self.why = kind
        if cut:
            self._disable()
        elif self.mode is Mode.FOLLOWING:
            self._begin_landing()

    def _begin_landing(self) -> None:
        state = self.guard.arrays
        resting = state.position[0] > self._lower_stop - _ON_THE_STOP
        if not self.flying or (resting and abs(state.rate[0]) < 0.02):
            self._disable()
            return
        self.mode = Mode.LANDING
        self.landing.begin(state.position, state.rate, self.guard.blind)

    def _disable(self) -> None:
        self.mode = Mode.DISABLED
        self.flying = False
        self._direct[:] = self._quadrature[:] = 0.0
        self.amplifiers.cut()

    def _sensing_fault(self, code: int, index: int) -> None:
        if code in (guard.RANGE, guard.GAP_RANGE):
            if self.mode is Mode.LANDING:  # is on its way out of there
                return
            self._raise_fault('range', *faults.range_fault(code, index, self.guard))
        else:
            reason, remedy = faults.encoder_fault(code, self.guard)
            blind = self.guard.blind
            self._raise_fault('encoder', reason, remedy, cut=bool(blind[0]))
            if self.mode is Mode.LANDING and code != guard.RESIDUAL and blind.any():
                self._begin_landing()

    def _late(self) -> None:
        self.late_ticks += 1
        if self.flying and self.driver.late > self.parameters.boards.overrun:
            self._raise_fault('overrun', *faults.overrun_fault(self.driver.late))

    def _lose_boards(self, error: DriverError) -> StageError:
        kind = 'watchdog' if isinstance(error, WatchdogError) else 'board'
        self._raise_fault(kind, str(error), 'see to the boards', cut=True)
        self._drop_boards()
        return StageError(str(error))

    @contextlib.contextmanager
    def _or_drop_boards(self) -> Iterator[None]:
        """Where the boards fail outside of a sample they are given up. Raises StageError."""
        try:
            yield
        except DriverError as error:
            self._drop_boards()
            raise StageError(str(error)) from error

    def _drop_boards(self) -> None:
        self.driver.close()
        self.mode = Mode.LOST
        self.flying = False
