"""A reference in use: its timeline by the stage's sample numbers, and how far it is published."""

from __future__ import annotations

from maglev_model.axes import FloatArray
from maglev_model.phases import Phase
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Block, Timeline

_BURST = 128  # samples due at one time, at most; half of what a reader's queue holds


class ReferenceRun:
    """Begins where the platen was found at rest, and stays ``lead`` samples ahead of the stage.

    The stage's newest sample when it starts is sample 0 of its timeline. With ``autostart`` false
    it rests until :meth:`lift_off`.
    """

    def __init__(self, parameters: ReferenceParameters, lead: int, autostart: bool) -> None:
        self.autostart = autostart
        self.newest = 0
        self.phase = Phase.REST
        self._parameters = parameters
        self._lead = lead
        self._timeline: Timeline | None = None
        self._origin = 0  # the stage's sample that is the timeline's first
        self._next = 0  # the timeline's first sample that is not published

    @property
    def started(self) -> bool:
        """Whether there is a timeline to follow."""
        return self._timeline is not None

    @property
    def grounded(self) -> bool:
        """Whether nothing flies."""
        return self.phase in (Phase.REST, Phase.END)

    @property
    def over(self) -> bool:
        """Whether the stage has got beyond the beginning of END."""
        sample = self.newest - self._origin
        return (
            self.phase == Phase.END
            and self._timeline is not None
            and sample > (self._timeline.end or 0)
        )

    @property
    def ahead(self) -> int:
        """How far it is published beyond the stage's newest sample."""
        return self._origin + self._next - 1 - self.newest

    def observe(self, sequence: int) -> bool:
        """Take note of a measurement; false for one to be left alone.

        A number below the newest is another stage's: of one that has taken the place of a stage
        that stopped, which then begins anew without starting by itself; or, while the platen flies,
        of a second one, which will find the first and leave.
        """
        if sequence < self.newest:
            if not self.grounded:
                return False
            self._timeline, self._next = None, 0
            self.autostart, self.phase = False, Phase.REST
        self.newest = sequence
        return True

    def start(self, rest: FloatArray) -> None:
        """Begin at the newest sample, the platen at rest at ``rest`` (5,) [m, rad].

        Raises UnreachableError as :class:`Timeline`.
        """
        self._timeline = Timeline(self._parameters, rest, self.autostart)
        self._origin = self.newest

    def due(self) -> tuple[int, Block] | None:
        """What is to be published now, with the number of its first sample."""
        wanted = self.newest + self._lead - self._origin
        count = min(wanted - self._next, _BURST)
        if self._timeline is None or count <= 0:
            return None
        first = self._next
        self._next += count
        return self._origin + first, self._timeline.block(first, count)

    def enter_phase(self) -> bool:
        """Bring ``phase`` to the stage's newest sample; returns whether it is another one now."""
        before = self.phase
        if self._timeline is not None:
            self.phase = self._timeline.phase(self.newest - self._origin)
        return self.phase != before

    def lift_off(self) -> bool:
        """Start from rest with what is published next; false when it has started already."""
        return self._timeline is not None and self._timeline.lift_off(self._next)

    def land(self) -> bool:
        """Land with what is published next; false when it has landed already, or is about to."""
        return self._timeline is not None and self._timeline.land(self._next)
