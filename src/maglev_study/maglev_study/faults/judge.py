"""Judges a run by what truly happened: outputs, lines, watchdogs, and the platen's true state.

Nothing that the bridge believes is looked at, but for the time and the words of its fault.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from maglev_hw_bridge.emulation.rig import Rig
from maglev_model.axes import FloatArray
from maglev_study.faults.flight import Flight
from maglev_study.faults.hardware_faults import SHOWS
from maglev_study.faults.kinds import CUT, DEGRADED, Expected

RULES = {
    1: 'found out in time, or unobservable and bounded',
    2: 'landed softly, or no faster than foretold',
    3: 'outputs and amplifiers off within 25 ms of the end',
    4: 'no output from a fault to reset and zero command; no enable where it is forbidden',
    5: 'the component blamed is the one that failed',
    6: 'no hang, no leak, and a restart works',
}

_QUIET_AFTER = 0.025  # from a terminal state to when there is no output [s]
_QUIET = 1e-6  # [V]
_FLYING = 1e-4  # above the lower stop [m]
_OFF_COURSE = (1.5e-3, 3e-3, 3e-3)  # of y, x, z while nothing is found out [m]
_STILL = 5e-5  # what the others count at most while a fault is hidden [m]
_HIDDEN = np.array([2e-3, 2e-3, 2e-3, 2e-3, 5e-3, 5e-3])
"""How far a stuck encoder is off the truth when forces alone must have told of it [m]."""
_ROUNDING = 1e-9  # [m]
_FALL = 0.6  # longest, without current [s]
_CUT = 0.003  # without output in flight [s]
_PROMPT = 2  # samples that the promptest finding takes, however long they are
_FORETOLD = re.compile(r'strikes the \w+ stop at about ([\d.]+) m/s')
_LONGEST = 16.0  # [s]


class Verdict(NamedTuple):
    """What came of a run."""

    violations: tuple[tuple[int, str], ...]  # rule, and what happened
    impact: float  # greatest speed at a stop [m/s]
    detection: float | None  # from when it showed to when it was latched [s]
    ended: str  # landed, cut, on the ground
    reason: str  # of the fault, as the bridge says it


class Judge:
    """Watches a flight from its creation on."""

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        world = flight.world
        self.prior = flight.bridge.stage.fault
        self.seen: int | None = None  # tick of the new fault, or of a refusal
        self.latched = 0  # ticks until which the prior fault stayed latched
        self.reason = ''
        self.ended: int | None = None  # tick of the terminal state
        self.released: int | None = None  # tick of the end of the process
        self.problems: list[tuple[int, str]] = []
        self._resolution = np.array(flight.parameters.encoder.resolution)
        self.anew()
        self.may_enable = False  # a reset has gone well, or the process was started again
        self.enable_counts = True  # the enable line does what the bridge tells it,
        self.output_counts = True  # and so do the outputs
        self._quiet_after = flight.samples_in(_QUIET_AFTER)
        self._longest = longest = flight.samples_in(_LONGEST)
        self._state = np.zeros((longest, 10))
        self._volts = np.zeros((longest, 16))
        self._shift = np.zeros((longest, 6))  # what encoders read beside the truth [m]
        self._course = np.full((longest, 3), np.nan)
        self._enabled = np.zeros(longest, dtype=bool)
        self._phase_channels = world._outputs[0] * 8 + world._outputs[1]
        self._n = 0
        world.rig.forget_impact()
        world.observe = self._observe
        self._enabled_before = world.enabled

    # -- while it flies ----------------------------------------------------------------------------

    def _observe(self) -> None:
        self.look()  # homing takes many samples
        world, n = self.flight.world, self._n
        if n >= self._longest:
            raise RuntimeError('the run does not end')
        self._state[n] = world.rig.stage.state
        self._volts[n] = world.volts.ravel()
        self._shift[n] = self._beside()
        enabled = world.enabled
        self._enabled[n] = enabled and not self.may_enable and self.enable_counts
        if enabled and not self._enabled_before and self.flight.forbidden:
            self.blame(4, f'amplifiers enabled {self.flight.forbidden}')
        self._enabled_before = enabled
        self._n = n + 1

    def look(self) -> None:
        """Look at the fault, once a sample."""
        fault = self.flight.bridge.stage.fault
        self.prior = self.prior or self.flight.asked
        if self.prior is not None and fault is self.prior:
            self.latched = self._n
        if self.seen is None and fault is not None and fault is not self.prior:
            self.notice(fault.reason)

    def on_course(self, wanted: FloatArray) -> None:
        """The platen should be near ``wanted`` (5,) [m, rad], once it has left the stop."""
        if self._aloft(self._n - 1):
            self._course[self._n - 1] = wanted[:3]

    def notice(self, reason: str) -> None:
        """The bridge has found something out."""
        if self.seen is None:
            self.seen, self.reason = self._n, reason

    def anew(self) -> None:
        """What the encoders read now is taken for the truth."""
        self.baseline = self._beside()

    def _beside(self) -> FloatArray:
        return self._resolution * self.flight.world.deviation

    def end(self) -> None:
        """A terminal state is reached."""
        self.ended = self._n

    def release(self) -> None:
        """The process ends."""
        self.released = self._n

    def blame(self, rule: int, text: str) -> None:
        """A rule is broken."""
        if (rule, text) not in self.problems:
            self.problems.append((rule, text))

    @property
    def shift(self) -> int:
        """Index of the next sample that is logged."""
        return self._n

    def log(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """True states (n, 10), outputs (n, 16) [V], encoders beside the truth (n, 6) [m], enable.

        Of shape (n,), the last.
        """
        n = self._n
        shift, enabled = self._shift[:n] - self.baseline, self._enabled[:n]
        return self._state[:n], self._volts[:n], shift, enabled.astype(float)

    def marks(self, shows: list[int]) -> dict[str, float]:
        """What happened when in the log [ms]."""
        marks = {
            'shows': self._first_sign(shows),
            'found': self.seen,
            'over': self.ended,
            'process ended': self.released,
        }
        return {name: 1e3 * self.flight.period * at for name, at in marks.items() if at is not None}

    # -- afterwards --------------------------------------------------------------------------------

    def judge(self, expected: Expected, shows: list[int]) -> Verdict:
        """The verdict; ``shows`` are samples of the log at which something could be seen."""
        n = self._n
        first = self._first_sign(shows)
        hidden = self._is_hidden(expected.stuck, first)
        if hidden:
            first = self._first_sign([], _HIDDEN)
            gaps = sum(encoder < 4 for encoder in expected.stuck)
            expected = expected._replace(impact=CUT if gaps > 1 else expected.impact)
        impact = max(self.flight.world.rig.impact, self._across(self._state[: self._n]))
        self._judge_detection(expected, first)
        if not hidden:
            self._judge_course()
        self._judge_impact(expected, impact)
        self._judge_outputs()
        if self.reason and expected.blame and not re.search(expected.blame, self.reason):
            self.blame(5, f'blamed: {self.reason}')
        detection = None
        if self.seen is not None and first is not None:
            detection = self.flight.period * max(self.seen - first, 0)
        flew = bool(np.any(self._state[:n, 0] < self._floor - _FLYING))
        ended = ('cut' if self._was_cut() else 'landed') if flew else 'on the ground'
        return Verdict(tuple(self.problems), impact, detection, ended, self.reason)

    def _aloft(self, index: int) -> bool:
        return bool(self._state[min(index, self._n - 1), 0] < self._floor - _FLYING)

    @property
    def _end(self) -> int:
        return self._n if self.ended is None else self.ended

    @property
    def _floor(self) -> float:
        return self.flight.parameters.machine.gap_max

    def _first_sign(self, shows: list[int], most: FloatArray = SHOWS) -> int | None:
        wrong = np.any(np.abs(self._shift[: self._n] - self.baseline) > most + _ROUNDING, axis=1)
        signs = [int(np.argmax(wrong))] if wrong.any() else []
        return min([*shows, *signs], default=None)

    def _is_hidden(self, stuck: tuple[int, ...], first: int | None) -> bool:
        """Whether all other encoders stood still as well from when some stuck until it showed.

        Then the platen moves only where nothing is left to see it: it could as well be held by
        friction, or by a stop, as by the model alone nobody can tell within what it is off.
        """
        if not stuck or first is None:
            return False
        off = np.abs(self._shift[: first + 1] - self.baseline)[:, stuck].max(axis=1)
        begun = max(int(np.argmax(off > _ROUNDING)) - 1, 0)
        others = [encoder for encoder in range(6) if encoder not in stuck]
        moved = np.ptp(self._lengths(slice(begun, first + 1))[:, others], axis=0)
        return bool(others) and bool(np.all(moved <= _STILL))

    def _lengths(self, where: slice) -> FloatArray:
        """What the six encoders should read at samples of the log [m], (n, 6)."""
        y, x, z, phi, theta = self._state[where, :10:2].T
        r = self.flight.parameters.machine.radius
        return np.stack([y - r * phi, y + r * theta, y + r * phi, y - r * theta, x, z], axis=1)

    def _judge_detection(self, expected: Expected, first: int | None) -> None:
        if first is None or expected.seen is None:
            return
        first = max(first, self.latched)
        after = (self._end if self.seen is None else self.seen) - first
        most = max(self.flight.samples_in(expected.seen), _PROMPT)
        if after > most and (self._aloft(first) or not expected.aloft):
            what = 'never found out' if self.seen is None else 'found out late'
            self.blame(1, f'{what}: {1e3 * self.flight.period * after:g} ms after it showed')

    def _judge_course(self) -> None:
        """What is not found out must not carry the platen away."""
        seen = self._end if self.seen is None else self.seen
        error = np.abs(self._state[:seen, :5:2] - self._course[:seen])
        with np.errstate(invalid='ignore'):
            astray = np.any(error > _OFF_COURSE, axis=1)
        if astray.any():
            at = int(np.argmax(astray))
            if self.seen is None or self.seen > at + self._quiet_after:
                worst = 1e3 * np.nanmax(error[: seen + 1], axis=0)
                self.blame(1, f'unseen, and off course by {np.round(worst, 1)} mm in y, x, z')

    def _judge_impact(self, expected: Expected, impact: float) -> None:
        if expected.impact is not CUT:
            if impact > expected.impact:
                self.blame(2, f'struck a stop at {impact:.3f} m/s, at most {expected.impact:g}')
            return
        told = _FORETOLD.search(self.reason)
        if told:
            foretold = float(told.group(1))
        else:
            at = min(self._end if self.seen is None else self.seen, self._n - 1)
            watchdog = self.flight.samples_in(self.flight.parameters.boards.watchdog)
            expired = min(at + watchdog, self._n - 1)  # by then it has cut
            foretold = max(self._fall_from(max(at - 1, 0)), self._fall_from(expired))
        most = max(DEGRADED, 1.15 * foretold + 0.03)
        if impact > most:
            self.blame(2, f'struck a stop at {impact:.3f} m/s, a cut was to give {foretold:.2f}')

    def _judge_outputs(self) -> None:
        if self.ended is None:
            return
        after = slice(self.ended + self._quiet_after, self._n)
        error = self._output_error(after)
        if self.output_counts and error.size and error.max() > _QUIET:
            self.blame(3, f'output {error.max():.2f} V off no current after the end')
        released = self._n if self.released is None else self.released
        if self._enabled[after.start : released].any():
            self.blame(3, 'amplifiers enabled while a fault is latched')
        if self._enabled[max(released + self._quiet_after, after.start) : self._n].any():
            self.blame(3, 'amplifiers enabled after the process has ended')

    def _output_error(self, where: slice) -> FloatArray:
        """How far the outputs of the phases are off no current [V], by sample; 0 V is allowed."""
        volts = self._volts[where][:, self._phase_channels]
        rest = np.array(self.flight.parameters.emulation.wiring.offset)
        error: FloatArray = np.minimum(np.abs(volts), np.abs(volts - rest))
        return error.max(axis=1) if len(error) else np.zeros(0)

    def _was_cut(self) -> bool:
        """Whether there was no output in flight for some samples."""
        n = self._n
        quiet = self._output_error(slice(0, n)) < _QUIET
        aloft = self._state[:n, 0] < self._floor - _FLYING
        samples = max(self.flight.samples_in(_CUT), 2)
        run = np.convolve(quiet & aloft, np.ones(samples), 'valid')
        return bool(np.any(run >= samples))

    def _across(self, state: FloatArray) -> float:
        """Greatest speed at a stop along X or Z, by the platen's states (n, 10) [m/s]."""
        machine, worst = self.flight.parameters.machine, 0.0
        for axis, stop in ((1, machine.x_max), (2, machine.z_max)):
            there = np.abs(state[:, 2 * axis]) >= stop - 1e-9
            met = np.flatnonzero(there[1:] & ~there[:-1])
            if len(met):
                worst = max(worst, float(np.max(np.abs(state[met, 2 * axis + 1]))))
        return worst

    def _fall_from(self, index: int) -> float:
        """What a cut at a sample of the log would give [m/s], by the world's own physics.

        Whose edge taps the lower stop may yet be tilted so far that the magnets lift it.
        """
        rig: Rig = self.flight.world.rig
        saved = rig.arrays.block.copy(), rig.stage.block.copy()
        rig.stage.state[:] = self._state[index]
        rig.arrays.current[:] = 0.0
        rig.forget_impact()
        rest = np.array(self.flight.parameters.emulation.wiring.offset)
        states = np.empty((self.flight.samples_in(_FALL), 10))
        for state in states:
            rig.advance(rest)
            state[:] = rig.stage.state
        speed = max(rig.impact, self._across(states))
        rig.arrays.block[:], rig.stage.block[:] = saved
        return speed
