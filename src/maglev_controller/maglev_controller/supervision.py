"""When the regulator acts: enabling, faults, and the landing the controller makes by itself."""

from __future__ import annotations

import numpy as np

from maglev_controller.bumpless_transfer import ModelMaps, check_retuning
from maglev_controller.design.margins import check_in_real_time
from maglev_controller.design_process import DesignProcess
from maglev_controller.following_error import FollowingWatch
from maglev_controller.landing import Landing
from maglev_controller.learning import iterative_learning
from maglev_controller.parameters import ControllerParameters
from maglev_controller.reference_buffer import ReferenceBuffer
from maglev_controller.reference_reach import ReferenceReach
from maglev_controller.regulator import MeasurementFault, Regulator
from maglev_model.axes import FloatArray
from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase

_CATCH_UP = 0.3  # time a landing has to bring back a platen that did not follow [s]
_LATE = 0.02  # the rest before a lift-off that is followed is over by, at most [s]
_FLYING_MARGIN = 5e-4  # above the lower stop, beyond encoder and stop compliance [m]

Wanted = tuple[FloatArray, FloatArray, FloatArray]
"""Position, velocity and acceleration of one sample's reference, (5,) each [m, rad]."""


class Supervisor:
    """Runs the regulator when it should run, and sees to it that no current flows otherwise.

    Without current the platen is slammed into the upper stop from anywhere above the equilibrium,
    so while the measurement can be believed every way out of flight is a landing; when it cannot,
    :attr:`status` says that the controller has given up, and the stage lands as it can.
    ``direct_current`` and ``quadrature_current`` (4,) [A] hold the answer of the last :meth:`step`,
    ``limited_by`` what limited it, as bits of :mod:`maglev_model.inverse`. ``learning`` is what
    learns while the reference tracks, None where nothing repeats.
    """

    def __init__(
        self, parameters: ControllerParameters, *, enabled: bool = True, hurried: bool = False
    ) -> None:
        """With ``hurried`` the stage does not wait for an answer, so that a law can be late.

        Raises ParameterError when the regulator cannot be designed, or the learning, and for
        margins that such a stage does not leave.
        """
        self.parameters = parameters
        self.regulator = Regulator(parameters)
        self.learning = iterative_learning(parameters)
        self.references = ReferenceBuffer()
        self.mode = Mode.WAITING if enabled else Mode.DISABLED
        self.reason = '' if enabled else 'not enabled'
        self.limited_by = 0
        self.direct_current: FloatArray = np.zeros(4)
        self.quadrature_current: FloatArray = np.zeros(4)
        self._landing: Landing | None = None
        self._after_landing = Mode.DISABLED
        self._gave_up = False
        self._following_watch = FollowingWatch(parameters)
        self._reach = ReferenceReach(parameters)
        self._row = -1  # of the reference last followed in this flight
        self._may_lift_off = False  # a rest was seen since the enable, and since a flight's middle
        self._segment = -1
        self._hurried = hurried
        if hurried:
            check_in_real_time(parameters, self.regulator.designs)
        self._hurry()
        self._warm_up()

    def _hurry(self) -> None:
        if self.regulator.foreign is not None:
            self.regulator.foreign.hurried = self._hurried

    def _warm_up(self) -> None:
        """Compile, or load what was compiled, before the first sample asks for it."""
        stop = self.parameters.machine.gap_max
        rest = np.array([stop, 0.0, 0.0, 0.0, 0.0]), np.zeros(5), np.zeros(5)
        self._regulate(np.full(4, stop), 0.0, 0.0, rest)
        Landing(self.parameters, *rest).step()
        self._watch_following(rest)
        self._reach.fault(*rest)
        self._start_afresh()
        self._no_current()

    @property
    def flying(self) -> bool:
        """Whether currents flow."""
        return self.mode in (Mode.REGULATING, Mode.LANDING)

    @property
    def status(self) -> Status:
        """What the stage is to know of the controller, with the currents."""
        if self._gave_up:
            return Status.GAVE_UP
        return Status.FLYING if self.flying else Status.RESTING

    def redesign(self, parameters: ControllerParameters) -> DesignProcess:
        """Begin to design a regulator for new parameters, to :meth:`adopt` between two steps.

        Raises ParameterError for what cannot change in flight.
        """
        if self.flying:
            check_retuning(self.parameters, parameters)
        return DesignProcess(self.regulator, parameters)

    def adopt(self, regulator: Regulator, maps: ModelMaps) -> None:
        """Go on with another regulator, in flight without a jump of its output.

        Raises ParameterError when it flies by now and that cannot change in flight, or when
        somebody else's law cannot be made.
        """
        if self.flying:
            regulator.take_over(self.regulator, maps)
        else:
            regulator.make_foreign()
            if self.learning is not None:
                self.learning = self.learning.redesigned(regulator.parameters)
        self.regulator, self.parameters = regulator, regulator.parameters
        self._following_watch.tune(regulator.parameters)
        self._reach = ReferenceReach(regulator.parameters)
        self._hurry()

    def enable(self) -> tuple[bool, str]:
        """Follow the reference from its next lift-off on; refused while a fault is latched."""
        if self.mode == Mode.FAULT:
            return False, f'{self.reason}; reset first'
        if self.mode == Mode.LANDING:
            return False, f'{self.reason}: landing by itself; enable when that is over'
        if self.mode == Mode.DISABLED:
            self.mode, self.reason = Mode.WAITING, ''
            self._may_lift_off = False
        return True, 'enabled'

    def disable(self) -> tuple[bool, str]:
        """End with no current: after a landing when the platen flies."""
        if self.flying:
            if self.mode == Mode.REGULATING:
                self._land('disabled')
            return True, 'landing first, then the currents end'
        if self.mode != Mode.FAULT:
            self.mode, self.reason = Mode.DISABLED, 'disabled'
        return True, 'disabled'

    def stop(self, reason: str) -> tuple[bool, str]:
        """End in a fault: after a landing when the platen flies."""
        if self.mode == Mode.REGULATING:
            self._land(reason)
        if self.mode == Mode.LANDING:
            self.reason, self._after_landing = reason, Mode.FAULT
            return True, 'landing; then call ~/reset, then ~/enable'
        if self.mode != Mode.FAULT:
            self.mode, self.reason = Mode.FAULT, reason
        return True, 'no current flows; call ~/reset, then ~/enable'

    def give_up(self, reason: str) -> None:
        """End in a fault at once: what flies is the stage's to bring down."""
        self._gave_up = self._gave_up or self.flying
        self.mode, self.reason = Mode.FAULT, reason
        self._no_current()

    def reset_fault(self) -> tuple[bool, str]:
        """Clear a latched fault; the controller is then disabled."""
        if self.mode != Mode.FAULT:
            still = self.mode == Mode.LANDING and self._after_landing == Mode.FAULT
            return False, f'{self.reason}: still landing' if still else 'there is no fault'
        cleared, self.mode, self.reason = self.reason, Mode.DISABLED, 'reset, not enabled'
        self._gave_up = False
        return True, f'cleared: {cleared}'

    def restart(self) -> None:
        """The stage began anew: what was known of it, and of its reference, is void."""
        self.references.stage_began_anew()
        self._may_lift_off = False
        if self.mode == Mode.REGULATING:
            self.mode, self.reason = Mode.WAITING, ''
        elif self.mode == Mode.LANDING:
            self.mode = self._after_landing
        self._no_current()

    def step(self, row: int, gap: FloatArray, x: float, z: float) -> None:
        """Answer one measurement: ``gap`` (4,), ``x``, ``z`` [m].

        ``row`` is that of its reference in :attr:`references`, -1 when there is none, which in
        flight means that the reference is lost.
        """
        self.references.renewed = False
        if self.mode == Mode.WAITING and row >= 0:
            self._await_lift_off(row)
        elif self.mode == Mode.REGULATING and row < 0:
            self._land('the reference stopped')
        elif self.mode == Mode.REGULATING and not self._wants_current(row):
            self._end(float(np.mean(gap)))
        if self.mode == Mode.REGULATING:
            self._follow(row, gap, x, z)
        elif self.mode == Mode.LANDING:
            self._descend(gap, x, z)
        else:
            self._no_current()

    def _await_lift_off(self, row: int) -> None:
        """Regulate from a lift-off on that begins, and where a rest was seen since the enable.

        What comes from the middle of a flight is looked into once, until there is a rest again.
        """
        if not self._wants_current(row):
            self._may_lift_off = True
        elif self._may_lift_off:
            self._may_lift_off = self._just_rested(row)
            if self._may_lift_off:
                self._start_afresh()
                self.mode = Mode.REGULATING

    def _just_rested(self, row: int) -> bool:
        """Whether one of the references right before wants no current, seen in time or not."""
        references, sequence = self.references, self.references.sequence.item(row)
        late = round(_LATE / self.parameters.sample_time)
        rows = (references.find(sequence - n) for n in range(1, late + 1))
        return any(row >= 0 and not self._wants_current(row) for row in rows)

    def _start_afresh(self) -> None:
        self.regulator.reset()
        self._following_watch.reset()
        self._row = -1
        if self.learning is not None:
            self.learning.rest()

    def _wants_current(self, row: int) -> bool:
        return self.references.phase.item(row) not in (Phase.REST, Phase.END)

    def _end(self, gap: float) -> None:
        """The reference wants no current any more."""
        if gap < self.parameters.machine.gap_max - _FLYING_MARGIN:
            self._land('the reference ended in flight')
        else:
            self.mode = Mode.WAITING

    def _follow(self, row: int, gap: FloatArray, x: float, z: float) -> None:
        references, wanted = self.references, self.references.at(row)
        fault = self._reach.fault(*wanted)
        if fault:
            self._refuse_reference(fault, gap, x, z)
            return
        phase, segment = references.phase.item(row), references.segment.item(row)
        if segment != self._segment:
            self._segment = segment
            restart = self.parameters.internal_model.restart_at_step
            if restart and phase == Phase.STEP:
                self.regulator.reset(in_flight=True)
        self._row = row
        self._regulate(gap, x, z, wanted, measured=phase == Phase.TRACK)
        if self.regulator.fault and self.mode == Mode.REGULATING:
            self.stop(self.regulator.fault)
        self._watch_following(wanted)

    def _refuse_reference(self, fault: str, gap: FloatArray, x: float, z: float) -> None:
        """Land from where the last one was that could be followed; not to lift off is enough."""
        if self._row < 0:
            self.mode = Mode.WAITING
        self.stop(fault)
        if self.flying:
            self._descend(gap, x, z)
        else:
            self._no_current()

    def _watch_following(self, reference: Wanted) -> None:
        """Give up a platen that does not follow: whoever lands it should not rely on this law.

        A law of somebody else's is followed by the controller's own first.
        """
        position, velocity, _ = reference
        failed = self._following_watch.step(position, velocity, self.regulator.error)
        if not failed or not self.flying:
            return
        if self.mode == Mode.REGULATING and self.regulator.foreign is not None:
            self.stop(failed)
        else:
            self.give_up(failed)

    def _land(self, reason: str) -> None:
        self.regulator.fall_back(reason)
        self._following_watch.reset(_CATCH_UP)
        self.mode, self.reason, self._after_landing = Mode.LANDING, reason, Mode.DISABLED
        self._landing = Landing(self.parameters, *self.references.at(self._row))

    def _descend(self, gap: FloatArray, x: float, z: float) -> None:
        assert self._landing is not None
        wanted = self._landing.step()
        if self._landing.done:
            self.mode, self.reason = self._after_landing, f'landed: {self.reason}'
            self._no_current()
        else:
            self._regulate(gap, x, z, wanted)
            self._watch_following(wanted)

    def _regulate(
        self, gap: FloatArray, x: float, z: float, reference: Wanted, measured: bool = False
    ) -> None:
        if self.learning is not None:
            self.learning.look_ahead(self.regulator.arrays, measured, *reference[:2])
        try:
            self.limited_by = self.regulator.step(
                gap, x, z, *reference, self.direct_current, self.quadrature_current
            )
        except MeasurementFault as fault:
            self.give_up(str(fault))
            return
        if self.learning is not None:
            self.learning.learn(self.regulator.arrays)

    def _no_current(self) -> None:
        self.direct_current[:] = 0.0
        self.quadrature_current[:] = 0.0
        self.limited_by = 0
