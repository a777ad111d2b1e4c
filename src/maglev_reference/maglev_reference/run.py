"""A reference in use: its timeline by the stage's sample numbers, and when it may be followed.

It wants current only of a controller that regulates: it rests until a controller was seen, and
leaves its run when the controller does not follow, or lands by itself. After that only a
:meth:`ReferenceRun.lift_off` makes it fly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from maglev_model.axes import FloatArray
from maglev_model.contract.modes import Mode
from maglev_model.contract.phases import Phase
from maglev_reference.check import UnreachableError
from maglev_reference.given_points import Candidate, Point, Through, step
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Block, Timeline

_BURST = 128  # samples due at one time, at most; half of what a reader's queue holds
_STILL = 1.0  # after which a platen on the ground lies still [s]

_GROUND = (Phase.REST, Phase.END)

_OBSTACLES = {
    Mode.DISABLED: ('the controller is disabled', ('enable',)),
    Mode.FAULT: ('the controller is in a fault', ('reset', 'enable')),
    Mode.LANDING: ('the controller lands by itself', ('enable',)),
}


def samples_ahead(time: float, period: float) -> int:
    """Samples of a ``period`` that reach a ``time`` ahead [s]."""
    return math.ceil(time / period - 1e-9)


class ReferenceRun:
    """Begins where the platen was found at rest, and stays ``lead`` samples ahead of the stage.

    The stage's newest sample when it starts is sample 0 of its timeline. With ``autostart`` false
    it rests until :meth:`lift_off`.
    """

    def __init__(self, parameters: ReferenceParameters, lead: int, autostart: bool) -> None:
        self.autostart = autostart
        self.controller: Mode | None = None  # as it was last seen
        self.left = ''  # why the run was left, until the next one
        self.newest = 0
        self.phase = Phase.REST
        self._parameters = parameters
        self._lead = lead
        self._answered = 0  # the newest sample that the controller has answered
        self._timeline: Timeline | None = None
        self._origin = 0  # the stage's sample that is the timeline's first
        self._next = 0  # the timeline's first sample that is not published
        self._candidate: Candidate | None = None

    @property
    def started(self) -> bool:
        """Whether there is a timeline to follow."""
        return self._timeline is not None

    @property
    def grounded(self) -> bool:
        """Whether nothing flies."""
        return self.phase in _GROUND

    @property
    def idle(self) -> bool:
        """Whether it has rested for a while, and goes on until :meth:`lift_off`.

        The while is for what may still move after a run that was left.
        """
        sample = self.newest - self._origin - round(_STILL / self._parameters.sample_time)
        return self._timeline is not None and self._timeline.settled(max(sample, 0))

    @property
    def over(self) -> bool:
        """Whether the stage has got beyond the beginning of END, or began anew in flight."""
        if self._timeline is None:
            return bool(self.left)
        return self.phase == Phase.END and self.newest - self._origin > (self._timeline.end or 0)

    @property
    def ahead(self) -> int:
        """How far it is published beyond the stage's newest sample."""
        return self._origin + self._next - 1 - self.newest

    def observe(self, sequence: int, *, silent: bool = False) -> bool:
        """Take note of a measurement; false for one to be left alone.

        A number below the newest is another stage's: of one that has taken the place of a stage
        that stopped, which then begins anew without starting by itself; or, while the platen flies
        and its stage is not ``silent``, of a second one, which will find the first and leave.
        """
        if sequence < self.newest:
            if not (self.grounded or silent):
                return False
            self.left = '' if self.grounded else self.left or 'the stage began anew in flight'
            self._timeline, self._next = None, 0
            self.autostart, self.phase = False, Phase.REST
        self.newest = sequence
        self._rest_on()
        return True

    def _rest_on(self) -> None:
        """Before lift-off, rest longer where the stage has gone past all that was published.

        Whoever was held up so long would else publish a lift-off that should have begun already,
        and which no controller follows from its middle.
        """
        behind = self.newest - self._origin - self._next
        if behind > 0 and self._resting:
            self._origin += behind

    @property
    def _resting(self) -> bool:
        """Whether nothing but the rest before a lift-off was published."""
        last = max(self._next - 1, 0)
        return self._timeline is not None and self._timeline.phase(last) == Phase.REST

    def plan(self, rest: FloatArray) -> Timeline:
        """What to :meth:`start`, the platen at rest at ``rest`` (5,) [m, rad].

        Takes its time, in which the stage goes on. Raises ParameterError as :class:`Timeline`.
        """
        return Timeline(self._parameters, rest, self.autostart)

    def start(self, timeline: Timeline) -> None:
        """Begin at the newest sample."""
        self._timeline = timeline
        self._origin = self.newest

    def observe_controller(self, mode: Mode, sequence: int) -> bool:
        """Take note of what the controller did at a sample; whether that shows that the stage runs.

        It does where another stage's measurements cover all that is heard of it.
        """
        runs = sequence > max(self._answered, self.newest)
        self.controller, self._answered = mode, sequence
        return runs

    def obstacle(self) -> tuple[str, tuple[str, ...]]:
        """Why the controller would not follow a lift-off, and its services that change that."""
        if self.controller is None:
            return 'no controller was seen', ()
        return _OBSTACLES.get(self.controller, ('', ()))

    def give_way(self) -> str:
        """Leave the run when the controller does not follow; returns why, once.

        On the stop it then rests, in flight it has ended: what holds the platen up is the
        controller's own landing.
        """
        if self._timeline is None or self.controller is None:
            return ''
        reason, _ = self.obstacle()
        sample = self._answered - self._origin
        if self.controller == Mode.WAITING and 0 <= sample <= self.newest - self._origin:
            wanted = self._timeline.phase(sample) not in _GROUND
            reason = 'the controller does not follow' if wanted else ''
        if not reason or not self._timeline.abandon(self._next):
            return ''
        self.left = reason
        return reason

    def due(self, *, slowly: bool = False) -> tuple[int, Block] | None:
        """What is to be published now, with the number of its first sample.

        ``slowly``, that is only what the newest sample itself waits for.
        """
        if self._timeline is None:
            return None
        wanted = self._reached + (1 if slowly else self._lead) - self._origin
        if self.controller is None:
            wanted = min(wanted, self._timeline.segments[0].last + 1)
        count = min(wanted - self._next, _BURST)
        if count <= 0:
            return None
        first = self._next
        self._next += count
        return self._origin + first, self._timeline.block(first, count)

    @property
    def _reached(self) -> int:
        """The newest sample there is, be it the controller that tells of it.

        In lockstep the loop would wait for ever for what follows a measurement that another stage's
        has covered.
        """
        published = self._answered < self._origin + self._next
        return max(self.newest, self._answered) if published else self.newest

    def enter_phase(self) -> bool:
        """Bring ``phase`` to the stage's newest sample; returns whether it is another one now."""
        before = self.phase
        if self._timeline is not None:
            self.phase = self._timeline.phase(self.newest - self._origin)
        return self.phase != before

    def lift_off(self, rest: FloatArray) -> bool:
        """Start with what is published next; false when it has started already.

        The platen is at rest at ``rest`` (5,) [m, rad]. Raises UnreachableError where it cannot
        lift off from there. Whether the controller follows is for :meth:`obstacle` to say.
        """
        if self._timeline is None or not self._timeline.lift_off(self._next, rest):
            return False
        self.left = ''
        return True

    def propose(self, names: Sequence[str], points: Sequence[Point]) -> bool:
        """Take a trajectory in, to be followed from the hover once :meth:`consider` has checked it.

        Returns whether it takes the place of another that is not checked yet. Raises
        UnreachableError where it makes no motion, and while the platen does not hover.
        """
        hover = self._hover()
        return self._take(Candidate(Through(names, points, hover), hover, self._parameters))

    def propose_step(self, axis: str, distance: float) -> bool:
        """The same for a step of one axis by a ``distance`` [m, rad]."""
        hover = self._hover()
        motion = step(axis, distance, hover, self._parameters)
        return self._take(Candidate(motion, hover, self._parameters))

    def _take(self, candidate: Candidate) -> bool:
        before, self._candidate = self._candidate, candidate
        return before is not None

    def consider(self) -> float | None:
        """Check some more of what was proposed; its length [s] when it is followed from now on.

        Raises UnreachableError, and forgets it, where it cannot be followed.
        """
        candidate, self._candidate = self._candidate, None
        if candidate is None:
            return None
        done = candidate.check()
        hover = self._hover()
        if not np.array_equal(hover, candidate.hover):
            raise UnreachableError('the reference does not hover any more where it did')
        if not done:
            self._candidate = candidate
            return None
        assert self._timeline is not None
        self._timeline.follow(self._next, candidate.motion, candidate.samples)
        return candidate.motion.length

    def _hover(self) -> FloatArray:
        if self._timeline is None:
            raise UnreachableError('there is no stage')
        reason, _ = self.obstacle()
        hover = self._timeline.hover(self._next)
        if reason or hover is None:
            raise UnreachableError(reason or 'the reference does not hover')
        return hover

    def land(self) -> bool:
        """Land with what is published next; false when it has landed already, or is about to."""
        return self._timeline is not None and self._timeline.land(self._next)
