"""One run: a fault, or two, at an instant of a phase; then what comes of it, to a restart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from maglev_model.contract.controller_watch import Status
from maglev_model.contract.modes import Mode
from maglev_study.faults.catalogue import KINDS
from maglev_study.faults.flight import Answer, Bridge, Flight
from maglev_study.faults.hardware_faults import blame_of
from maglev_study.faults.judge import Judge, Verdict
from maglev_study.faults.kinds import CUT, Expected, Fault, Run
from maglev_study.faults.programme import BEFORE_THE_FIRST_SAMPLE, ON_THE_GROUND

_WATCHED = 1.0  # without a finding, until the operator lands [s]
_ALOFT = 0.3  # of that in flight, where the run began on the ground [s]
_UP_AGAIN = 0.9  # from the reset to flight [s]
_LONGEST_END = 4.0  # from then on to the end [s]
_AFTERWARDS = 0.08  # [s]
_REST_SPEED = 1e-3  # [m/s]
_LONGEST_FALL = 0.7  # [s]
_GRACE = 0.03  # for what must be quiet within 25 ms [s]
_INSIST = 0.02  # of currents that must not be followed [s]


class Scenario(NamedTuple):
    """Everything that makes a run: the same one gives the same run."""

    machine: int
    phase: str
    instant: float  # share of the phase
    faults: tuple[Fault, ...]
    seed: int  # of what is random in the faults


class Course:
    """A run on its way."""

    def __init__(self, flight: Flight, scenario: Scenario) -> None:
        self.flight, self.scenario = flight, scenario
        self.judge = Judge(flight)
        rng = np.random.default_rng([31337, scenario.seed])
        flight.world.rng = rng
        self.early = bool(rng.integers(2))  # before the boards are opened, or before homing
        self.shows: list[int] = []
        self.hits: list[int] = []
        self.run = Run(flight, rng, self.hits)
        lying = {fault.call for fault in scenario.faults if 'wrong' in fault.kind}
        self.judge.enable_counts = 'write_digital' not in lying
        self.judge.output_counts = 'write_analog' not in lying
        if scenario.phase not in ('after a fault', 'reset'):
            flight.act()  # what is due at this very sample, and nothing later
            flight.acting = False
        self.begun = [False] * len(scenario.faults)
        self.expected = expected_of(scenario.faults)

    # -- faults ------------------------------------------------------------------------------------

    def begin(self, elapsed: int) -> None:
        """Let those faults begin that are due."""
        for index, fault in enumerate(self.scenario.faults):
            delay = self.flight.samples_in(1e-3 * fault.delay)
            if not self.begun[index] and elapsed >= delay:
                self.begun[index] = True
                KINDS[fault.kind].begin(self.run, fault)
                self.flight.world.refresh()
                self.note()

    def note(self) -> None:
        """Date in the log what showed since the last time."""
        while len(self.shows) < len(self.hits):
            self.shows.append(self.judge.shift)

    # -- the run -----------------------------------------------------------------------------------

    def fly(self) -> Verdict:
        """To the end, and beyond: what must hold after it."""
        flight, judge = self.flight, self.judge
        if self._prepare():
            self._watch()
        flight.acting = False
        judge.end()
        self._settle()
        self._insist()
        self._release()
        self._restart()
        self.note()
        if flight.bridge.stray and 'injected' not in flight.bridge.stray:
            judge.blame(6, f'an error of its own: {flight.bridge.stray}')
        return judge.judge(self.expected, self.shows)

    def _prepare(self) -> bool:
        """What comes before the first sample; whether sampling began."""
        bridge, phase = self.flight.bridge, self.scenario.phase
        if phase not in BEFORE_THE_FIRST_SAMPLE:
            return True
        if phase == 'homing' and self.early:
            self.begin(0)
        if phase == 'homing' and not bridge.configure():
            return self._refused()
        self.begin(0)
        if phase == 'homing' and bridge.alive and not self.flight.skip_homing:
            self.judge.anew()  # zeros are defined anew
            if not bridge.home():
                return self._refused()
        return bridge.alive and (bridge.activate() or self._refused())

    def _refused(self) -> bool:
        self.judge.notice(self.flight.bridge.refused)
        return False

    def _watch(self) -> None:
        """Until it is over, by the fault or, where that is not found out, by the operator."""
        flight, start = self.flight, self.flight.samples
        last = 1e-3 * max(fault.delay for fault in self.scenario.faults)
        until = start + flight.samples_in(last + _WATCHED)
        if self.scenario.phase in ON_THE_GROUND:
            begin = flight.course.spans['lift-off'][1]
            if self.scenario.phase in ('after a fault', 'reset'):
                begin = flight.course.spans['reset'][1] + flight.samples_in(_UP_AGAIN)
            until = max(until, begin + flight.samples_in(_ALOFT))
        while not self._over():
            if flight.samples == until:
                flight.acting = False
                flight.bridge.deactivate()
            if flight.samples > until + flight.samples_in(_LONGEST_END):
                self.judge.blame(6, 'the run does not come to an end')
                return
            self.begin(flight.samples - start)
            self.step()
            if flight.samples < until:
                self._compare()

    def step(self) -> None:
        """One sample."""
        self.flight.step()
        self.note()
        self.judge.look()
        if self.judge.seen is not None and self.judge.prior is None:
            self.flight.controller.heeded = False

    def _over(self) -> bool:
        bridge, judge = self.flight.bridge, self.judge
        if not (bridge.alive and bridge.active) or bridge.lost:
            return True
        fault = bridge.stage.fault
        if fault is None or bridge.stage.flying:
            return False
        return fault is not judge.prior or self.scenario.phase.startswith('landing')

    def _compare(self) -> None:
        """Note where the platen should be, while the controller carries it there."""
        flight = self.flight
        healthy = flight.controller.alive and self.judge.seen is None
        if not healthy or flight.bridge.ending:
            return
        if flight.controller.supervisor.mode is Mode.REGULATING:
            course = flight.course
            row = min(flight.bridge.sequence, len(course.kind) - 1)
            if not course.jumps(row):
                self.judge.on_course(course.references.position[row])

    def _settle(self) -> None:
        """Go on until the platen rests, and for a while."""
        flight, state = self.flight, self.flight.world.rig.stage.state
        still = 0
        for _ in range(flight.samples_in(_LONGEST_FALL)):
            self.step()
            still = still + 1 if abs(state[1]) < _REST_SPEED else 0
            if still >= flight.samples_in(_AFTERWARDS):
                return

    def _insist(self) -> None:
        """Command currents, reset, and command them again: none must flow before one of zero."""
        flight = self.flight
        bridge = flight.bridge
        flight.controller.alive = False
        if not bridge.alive or bridge.stage.fault is None:
            return
        self._command()
        flight.world.cure()
        flight.forbidden = ''
        self.judge.may_enable = bridge.reset()
        self._command()

    def _command(self) -> None:
        flight = self.flight
        for _ in range(flight.samples_in(_INSIST)):
            currents = np.full(4, 2.0)
            flight.inbox = [Answer(flight.bridge.sequence, currents, currents, Status.FLYING)]
            self.step()

    def _release(self) -> None:
        """End the process, with its faults, and see that nothing is left behind."""
        flight, judge = self.flight, self.judge
        bridge, world = flight.bridge, flight.world
        if bridge.alive and self._fails_in_calls:
            self._cycle()
        bridge.end()
        for _ in range(2):
            flight.step()
        judge.may_enable = False
        judge.release()
        world.let_pass(_GRACE)
        left = [board for board in world.cards if not self._cannot_close(int(board))]
        if left and not bridge.vanished:
            judge.blame(6, f'boards left open: {", ".join(left)}')
        world.process_ended()
        world.let_pass(_GRACE)

    def _cannot_close(self, board: int) -> bool:
        return any(
            fault.call == 'close' and board in fault.targets for fault in self.scenario.faults
        )

    @property
    def _fails_in_calls(self) -> bool:
        return any(fault.kind.startswith('call') for fault in self.scenario.faults)

    def _cycle(self) -> None:
        """Through the life cycle once more, with the fault in the calls still there."""
        bridge = self.flight.bridge
        if bridge.active:
            bridge.deactivate()
            for _ in range(3):
                self.step()
        self.judge.may_enable = True
        bridge.cleanup()
        if self.flight.skip_homing:
            self.flight.forbidden = ''  # it is homed now
        if bridge.alive and bridge.configure() and bridge.home(vouched=True):
            bridge.activate()
            for _ in range(3):
                self.step()
            bridge.deactivate()
            self.step()
            bridge.cleanup()

    def _restart(self) -> None:
        flight, judge = self.flight, self.judge
        world = flight.world
        world.cure()
        flight.forbidden = ''
        judge.may_enable = True
        world.rest()
        bridge = Bridge(flight.parameters, world)
        ready = bridge.configure() and bridge.home(vouched=True) and bridge.activate()
        if not ready:
            judge.blame(6, f'no restart: {bridge.refused or bridge.stray}')
        for _ in range(3):
            if ready and bridge.sample([]) is None:
                ready = False
                judge.blame(6, f'no sample after a restart: {bridge.refused or bridge.stray}')
        bridge.cleanup()


def expected_of(faults: tuple[Fault, ...]) -> Expected:
    """What must come of faults together: the mildest demand, any of them blamed."""
    each = [KINDS[fault.kind].expected(fault) for fault in faults]
    if len(each) == 1:
        return each[0]
    impacts = [one.impact for one in each if one.impact is not CUT]
    sensing = all(one.encoders for one in each)
    impact = CUT if sensing or len(impacts) < len(each) else max(impacts)
    encoders = tuple(i for one in each for i in one.encoders)
    words = [one.blame for one in each if not one.encoders]
    words += [blame_of(encoders)] if encoders else []  # which one sentence may name together
    blame = '|'.join(words) if all(words) else ''
    stuck = tuple(i for one in each for i in one.stuck)
    return Expected(impact, None, blame, stuck=stuck, encoders=encoders)


def fly(flight: Flight, scenario: Scenario) -> Verdict:
    """Fly a scenario from a flight that stands where its phase wants it; spends the flight."""
    return Course(flight, scenario).fly()
