"""Whose currents a stage follows: one controller's, taken up at rest, in order. No ROS here."""

from __future__ import annotations

import enum

import numpy as np

from maglev_model.axes import FloatArray

NOBODY = 0
"""The session of no controller."""

_PROMPT = 2
"""So many samples old an answer may be with which a controller is taken up."""


class Status(enum.IntEnum):
    """The values of ``Currents.status``: what the sender of currents does."""

    RESTING = 0  # no current is wanted: all currents are zero
    FLYING = 1  # currents to follow
    GAVE_UP = 2  # it cannot go on: the stage comes down by itself


class Verdict(enum.Enum):
    """What becomes of a command."""

    FOLLOWED = 'its currents are fresh'
    IGNORED = 'nothing: no current flows, or the stage comes down by itself already'
    ELSEWHERE = 'nothing: it is no answer to this stage'
    REFUSED = 'in flight a fault: the stage comes down by itself'


class ControllerWatch:
    """Judges each command that reaches a stage.

    At rest the controller that answers one of the newest samples with zero currents is taken up; it
    is known by its session. In flight its commands are followed, in the order of their samples.
    Anything else that comes in flight means that somebody else commands as well, or that the
    controller does not know what it does: it is refused, and the stage has no controller until it
    takes one up again. Only a stranger that rests and answers the sample of another stage is left
    alone: two graphs that have just met, of which the later one will leave. How old currents may
    be is the stage's to judge.
    """

    def __init__(self) -> None:
        self.session = NOBODY  # of the controller that is taken up
        self.newest = -1  # sequence number of its newest command
        self.why = ''  # the command judged last is not followed
        self.gave_up = False  # its sender said that it gives up

    @property
    def taken_up(self) -> bool:
        """Whether there is a controller."""
        return self.session != NOBODY

    def forget(self) -> None:
        """Have no controller: the next one is taken up at rest and with zero currents."""
        self.session, self.newest = NOBODY, -1

    def judge(
        self,
        session: int,
        sequence: int,
        status: int,
        direct_current: FloatArray,
        quadrature_current: FloatArray,
        *,
        stamped: bool,
        sample: int,
        flying: bool,
    ) -> Verdict:
        """Judge one command.

        ``session`` to ``quadrature_current`` (4,) [A] are the message's; ``stamped`` is whether its
        stamp is that of the measurement with its sequence number, ``sample`` the number of the
        stage's newest sample, ``flying`` whether currents flow.
        """
        known = session == self.session and self.taken_up
        self.gave_up = known and status == Status.GAVE_UP
        self.why = self._disorder(sequence, status, stamped, sample)
        resting = status == Status.RESTING
        asks = resting and bool(np.any(direct_current) or np.any(quadrature_current))
        if asks and not self.why:
            self.why = 'currents came from a controller that says it rests'
        if flying:
            stranger = self.taken_up and not known and session != NOBODY
            if stranger and resting and not asks and not stamped:
                self.why = 'a controller that rests answers another stage'
                return Verdict.ELSEWHERE
            return self._in_flight(known, sequence)
        return self._at_rest(known, session, sequence, status, sample)

    def _in_flight(self, known: bool, sequence: int) -> Verdict:
        if not self.taken_up:
            return Verdict.IGNORED
        if not known:
            self.why = 'currents came from somebody else than the controller that was taken up'
        if self.why:
            self.forget()
            return Verdict.REFUSED
        self.newest = sequence
        return Verdict.FOLLOWED

    def _at_rest(
        self, known: bool, session: int, sequence: int, status: int, sample: int
    ) -> Verdict:
        if not known and not self.why:
            self.why = self._strangeness(session, sequence, status, sample)
        if self.gave_up:
            self.forget()
        if self.why:
            return Verdict.IGNORED
        self.session, self.newest = session, sequence
        return Verdict.FOLLOWED

    def _disorder(self, sequence: int, status: int, stamped: bool, sample: int) -> str:
        """Why nobody's command can be followed that has these; or ''."""
        if status == Status.GAVE_UP:
            return 'the controller gave up'
        if status not in (Status.RESTING, Status.FLYING):
            return f'currents came with status {status}'
        if sequence > sample:
            return f'currents came for sample {sequence}, which is still to come'
        if sequence <= self.newest:
            return f'currents came for sample {sequence} after those for sample {self.newest}'
        if not stamped:
            return f'currents for sample {sequence} came with the stamp of another measurement'
        return ''

    @staticmethod
    def _strangeness(session: int, sequence: int, status: int, sample: int) -> str:
        """Why a controller is not taken up that commands this; or ''."""
        if session == NOBODY:
            return 'currents came without a session'
        if status != Status.RESTING:
            return 'no current flows until the controller has commanded none'
        if sample - sequence > _PROMPT:
            return f'currents came {sample - sequence} samples late'
        return ''
