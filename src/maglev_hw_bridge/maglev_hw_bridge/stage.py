"""The real stage behind the stage contract: encoders, commutation, amplifiers, boards and faults.

While boards and amplifiers are sound every fault ends in a landing that the bridge makes by itself,
or in a push down where no gap encoder tells where the platen is; otherwise the current is cut.
Either is latched until :meth:`reset`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from maglev_hw_bridge import amplifiers, faults
from maglev_hw_bridge.drivers import Driver, DriverError, Truthful
from maglev_hw_bridge.landing import Landing, impacts_of_cut, push_is_softer
from maglev_hw_bridge.mode import Mode as Mode
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.resting import RestingStage
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.gap_knock import GapKnock
from maglev_hw_bridge.sensing.knock import Knock
from maglev_model.axes import AXES, FloatArray
from maglev_model.contract.stage import EncoderSample, Fault, StageError, Truth, motor_currents

_SOFT = 0.05  # a degraded landing's speed at the stop [m/s]
_ROUNDING = 0.2  # of how many samples late
_BOUNCE = 0.1  # sooner again a stop input is not pressed anew [s]


class BridgeStage(RestingStage):
    """The :class:`~maglev_model.contract.stage.Stage` on boards, one sample per :meth:`read`."""

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
        super().__init__(parameters or BridgeParameters(), realtime, driver)
        self.late_ticks = 0
        self._all_knowing = self.driver if isinstance(self.driver, Truthful) else None
        self.landing = Landing(self.parameters)
        self._knock = Knock(self.parameters)
        self._gap_knock = GapKnock(self.parameters)
        self._zero = np.zeros(4)
        self._flowed = np.zeros(12)  # phase currents until the sample read last [A]
        self._behind = 0  # samples that this one was late by
        self._to_catch_up = 0  # late samples still to come when the landing began
        self._stale_samples = math.ceil(self.parameters.fault.stale / self.sample_time - 1e-9)
        self._longest_stop = round(self.parameters.boards.stop_time / self.sample_time)
        self._since_stop = -1  # samples that it lands since an emergency stop; -1: there was none
        self._bounce = math.ceil(_BOUNCE / self.sample_time)
        self._released = self._bounce  # samples since the stop input was pressed last, if no more
        self._named: set[tuple[int, ...]] = set()  # what the fault latched says of sensing
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
        self.guard.lose(4)
        self.guard.trust()

    # -- samples -----------------------------------------------------------------------------------

    @property
    def late(self) -> float:
        """How late the sample read last was, by the boards' clock [s]."""
        return self.driver.late

    def truth(self) -> Truth | None:
        """The true state of the sample read last; None unless the boards are emulated."""
        if self._all_knowing is None:
            return None
        state, current, between = self._all_knowing.truth()
        load: FloatArray = self.amplifiers.arrays.load.reshape(4, 3).max(axis=1)
        own_length = self.encoders.arrays.length + between
        return Truth(state, current[:4], current[4:], load, own_length)

    def read(self) -> EncoderSample:
        """The next sample; waits for the boards' clock. Raises StageError when they are lost."""
        if self.mode in (Mode.CLOSED, Mode.READY, Mode.LOST):
            raise StageError(f'no sample: {self.mode.value}')
        try:
            self.driver.read(self._counts)
        except DriverError as error:
            raise self._lose_boards(error) from error
        length = self.encoders.decode(self._counts)
        self._keep_up()
        code, index = self.guard.watch(length, self._flowed, self.flying, self._behind)
        if code != guard.FINE:
            self._sensing_fault(code, index)
        if self.guard.returned and self.mode is Mode.LANDING:
            self._begin_landing()
        self._ask()
        self._look_for_rest()
        self._heed_stop_input()
        if self.driver.late > 0.5 * self.parameters.sample_time:
            self._late()
        return EncoderSample(length[:4].copy(), length.item(4), length.item(5))

    def _heed_stop_input(self) -> None:
        """Stop while it is pressed; beside a latched fault it is remembered, once for each time."""
        if not self.driver.stop_pressed:
            self._released = min(self._released + 1, self._bounce)
            return
        if self.fault is None or self._released == self._bounce:
            self.stop('the emergency stop is pressed', remedy='release it')
        self._released = 0

    def _ask(self) -> None:
        """Whether encoders that do not count do so when they are knocked, and go without if not."""
        watched = self.guard.arrays
        one = self._knock.look(watched, self.flying)
        hovers = self.flying and self.mode is Mode.FOLLOWING and not self._lifting
        gaps = self._gap_knock.look(watched, hovers)
        if one is not None:
            self._do_without(one)
        if gaps:
            self._do_without(*gaps)

    def _do_without(self, *encoders: int) -> None:
        self.guard.lose(*encoders)
        self._sensing_fault(guard.STUCK, encoders[0])

    def _keep_up(self) -> None:
        """Note how far behind its tick the sample is, and what flowed until that.

        What is put out while samples are caught up with flows after the last of them.
        """
        if self._behind == 0 or not self.flying:
            self._flowed[:] = self.amplifiers.arrays.current
        self._behind = int(self.driver.late / self.sample_time + _ROUNDING)

    def write(self, direct_current: Any, quadrature_current: Any, age: int = 0) -> None:
        """Currents of motors 1..4 [A], (4,) each, for the sample ``age`` before the last one.

        Raises ValueError when a shape is wrong or a current is not finite or too large (the bridge
        then lands), StageError when the boards are lost.
        """
        i_d = motor_currents('direct_current', direct_current)
        i_q = motor_currents('quadrature_current', quadrature_current)
        self._age = age
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
            self._follow(self._direct, self._quadrature)
        self._put_out()

    def _follow(self, i_d: FloatArray, i_q: FloatArray) -> str:
        """Drive the amplifiers as commanded, unless that is a fault; why a command was refused."""
        flows = any(i_d.tolist()) or any(i_q.tolist())
        if (flows or self.flying) and self._age >= self._stale_samples:
            self._raise_fault('stale', *faults.stale_fault(self._age * self.sample_time))
            return ''
        if self.flying and not flows and not self._on_the_stop():
            if hung := self._hung():
                self._do_without(*hung)
            else:
                self._raise_fault('controller', *faults.zero_fault(self.guard))
            return ''
        code, index = self._drive(i_d, i_q)
        if code in (amplifiers.FINE, amplifiers.SPENT):
            self._direct[:], self._quadrature[:] = i_d, i_q
            self.flying = flows
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

    def _drive(self, i_d: FloatArray, i_q: FloatArray) -> tuple[int, int]:
        """Have the amplifiers make these currents where x and z are, and what is to knock there."""
        state = self.guard.arrays
        i_d = self._gap_knock.added(state, i_d, i_q)
        i_q = self._knock.added(state, i_d, i_q)
        return self.amplifiers.drive(i_d, i_q, state.believed[4], state.believed[5])

    def _descend(self) -> None:
        state = self.guard.arrays
        self._since_stop += self._since_stop >= 0
        if self._to_catch_up > 0:  # until then the platen has gone on as before
            self._to_catch_up -= 1
            self.landing.begin(state.position, state.rate, self.guard.blind)
        too_long = self._since_stop > self._longest_stop
        if self.landing.step(state.position, state.rate, state.disturbance):
            self._disable()
        elif too_long:
            self._raise_fault('stop', *faults.overlong_fault(self.parameters), cut=True)
        elif self.landing.astray:
            self._raise_fault('current', *faults.stray_fault(), cut=True)
        else:
            i_d, i_q = self.landing.direct_current, self.landing.quadrature_current
            code, index = self._drive(i_d, i_q)
            if code not in (amplifiers.FINE, amplifiers.SPENT):
                why = faults.landing_fault(code, index, i_d, i_q, self.amplifiers)
                self._raise_fault('current', *why, cut=True)

    # -- faults ------------------------------------------------------------------------------------

    def land(self, why: str) -> None:
        """Land without a fault; the mode is DISABLED when it is done."""
        if self.mode is Mode.FOLLOWING:
            self.why = why
            self._begin_landing()

    def stop(self, why: str = 'emergency stop', kind: str = 'stop', remedy: str = '') -> None:
        """Latch a fault with that reason; lands while everything needed for that is sound.

        Where one is latched already, the next reset is refused: who asks for it may not know.
        """
        if kind == 'stop' and self.fault is not None:
            self._stopped_since = why
        if kind == 'stop' and self.mode is Mode.LANDING:
            self._since_stop = max(self._since_stop, 0)
        self._raise_fault(kind, why, remedy or 'see to what made it necessary')

    def cut_askew(self) -> None:
        """End the current of a platen that tilts where it was to rise a little.

        It falls back softly; in a landing an amplifier that is stuck on would lift it farther.
        """
        self._raise_fault('current', *faults.askew_fault(self.guard), cut=True)

    def _raise_fault(self, kind: str, reason: str, remedy: str, cut: bool = False) -> None:
        if self.fault is not None and not (cut and self.mode is Mode.LANDING):
            return
        if cut:
            flying = self.flying
            self._disable()
            if flying:
                reason += faults.consequence_of_cut(self.parameters, self.guard)
        fault = Fault(kind, reason, remedy, cut)
        self.fault = fault if self.fault is None else faults.then(self.fault, fault)
        self._named.clear()
        self.why = self.fault.kind
        if self.mode is Mode.FOLLOWING:
            self._begin_landing()

    def _begin_landing(self) -> None:
        state, blind = self.guard.arrays, self.guard.blind
        fails_in_lift = self._lifting and self.fault is not None and self.fault.kind != 'stop'
        near = not blind[0] and (self._touches() or (blind[3:].any() and self._falls_softly()))
        if not self.flying or fails_in_lift or near:
            self._disable()
            return
        if self.mode is Mode.FOLLOWING:
            self._since_stop = 0 if self.fault is not None and self.fault.kind == 'stop' else -1
        self.mode = Mode.LANDING
        self._to_catch_up = self._behind
        self.landing.begin(state.position, state.rate, blind)

    def _falls_softly(self) -> bool:
        """Whether it is so near the lower stop that no landing by half of the gaps is softer."""
        state = self.guard.arrays
        impacts = impacts_of_cut(self.parameters, state.position[0], state.rate[0])
        return set(impacts) == {'lower'} and impacts['lower'] < _SOFT

    def _sensing_fault(self, code: int, index: int) -> None:
        lands_for = self.fault if self.mode is Mode.LANDING else None
        if code in (guard.RANGE, guard.GAP_RANGE):
            if self.mode is Mode.LANDING:  # is on its way out of there
                return
            if self._lifting and code == guard.RANGE and AXES[index] in ('x', 'z'):
                return  # it stands at its home, which may be at the stops
            self._raise_fault('range', *faults.range_fault(code, index, self.guard))
        elif code == guard.MOTORS:
            why = faults.motor_fault(index, self.guard)
            self._raise_fault('current', *why)
            self._name_too(lands_for, (code, index), *why)
        else:
            blind = self.guard.blind
            y, rate = self.guard.arrays.position[0], self.guard.arrays.rate[0]
            reason, remedy = faults.encoder_fault(code, self.guard)
            pushed = blind[0] and self.flying and push_is_softer(self.parameters, y, rate)
            if pushed:
                reason += faults.consequence_of_push(self.parameters, self.guard)
            self._raise_fault('encoder', reason, remedy, cut=bool(blind[0]) and not pushed)
            self._name_too(lands_for, (code, *self.guard.blamed), reason, remedy)
            if self.mode is Mode.LANDING and code != guard.RESIDUAL and blind.any():
                self._begin_landing()

    def _name_too(self, fault: Fault | None, what: tuple[int, ...], why: str, remedy: str) -> None:
        """Add to the fault that it lands for what else is found out meanwhile, once."""
        if self.fault is fault is not None and what not in self._named:
            self.fault = fault._replace(
                reason=f'{fault.reason}; then {why}', remedy=f'{fault.remedy}; {remedy}'
            )
        self._named.add(what)

    def _late(self) -> None:
        self.late_ticks += 1
        if self.flying and self.driver.late > self.parameters.boards.overrun:
            self._raise_fault('overrun', *faults.overrun_fault(self.driver.late))
