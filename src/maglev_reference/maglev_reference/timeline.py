"""The whole reference from rest to rest, by sample number.

REST on the stop, LIFT_OFF, HOLD at home, a smooth way onto the trajectory and a run-in on it, TRACK
(or a STEP after another, each from rest), back home, LAND with a crawl at the end, END. Sample 0 is
the timeline's own first sample; times are sample numbers times the sample time.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from maglev_model.axes import FloatArray, Y
from maglev_model.contract.phases import Phase
from maglev_reference.check import UnreachableError, check_locked, check_rest, check_samples
from maglev_reference.currents import check_currents
from maglev_reference.motion import Kinematics, Motion, Stand, State, state_at
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.segments import Planner, Segment
from maglev_reference.trajectories import course, steps

_CHUNK = 256  # samples evaluated together, so that a value does not depend on who asks for how many
_CHECKED_TOGETHER = 65536
_MEASURED = (Phase.TRACK, Phase.STEP)
_GROUND = (Phase.REST, Phase.END)
_IN_FLIGHT = (Phase.HOLD, *_MEASURED)


class Block(NamedTuple):
    """Consecutive samples of the reference, in output order y, x, z, phi, theta."""

    phase: npt.NDArray[np.uint8]  # (n,)
    segment: npt.NDArray[np.uint32]  # (n,)
    position: FloatArray  # (n, 5) [m, rad]
    velocity: FloatArray  # (n, 5) [m/s, rad/s]
    acceleration: FloatArray  # (n, 5) [m/s^2, rad/s^2]
    target: FloatArray  # (n, 5) [m, rad]

    @classmethod
    def joined(cls, blocks: Iterable[Block], rows: slice = slice(None)) -> Block:
        """Some of the samples, ``rows``, of blocks one after another; of a single one no copy."""
        columns: Any = zip(*blocks, strict=True)
        whole = (each[0] if len(each) == 1 else np.concatenate(each) for each in columns)
        return cls(*(each[rows] for each in whole))


class Timeline:
    """The reference at any sample n >= 0.

    ``rest`` (5,) is where the platen was found at rest; without it, the middle of the lower stop.
    With ``autostart`` false it rests until :meth:`lift_off`. The whole reference is made and
    checked here, before anything moves: raises ParameterError for what cannot be made, as of a file
    that is missing, and UnreachableError, which is one, where it leaves the limits.
    """

    def __init__(
        self,
        parameters: ReferenceParameters,
        rest: FloatArray | None = None,
        autostart: bool = True,
    ) -> None:
        self._parameters = parameters
        self._at_rest = State.at_rest(self._rest_position(rest))
        make = steps if parameters.trajectory == 'steps' else course
        self._measured = make(parameters)  # once: what was checked is what every lift-off flies
        self._cached_chunk = -1
        self._cache: Block | None = None
        planner = self._full_plan(self._at_rest, 0, 0)
        self._adopt(planner.segments)
        self._check()
        if not autostart:
            planner = Planner(parameters, 0, 0, self._at_rest)
            planner.rest()
            self._adopt(planner.segments)

    @property
    def end(self) -> int | None:
        """The sample at which END begins; None while resting without a start."""
        last = self.segments[-1]
        return last.first if last.phase == Phase.END else None

    def phase(self, sample: int) -> Phase:
        """The phase at a sample."""
        return self.segments[self._index(sample)].phase

    def block(self, first: int, count: int) -> Block:
        """Samples ``first`` to ``first + count - 1``. Raises ValueError for a negative sample.

        However a range is cut into blocks, its values are the same to the last bit.
        """
        if first < 0 or count < 0:
            raise ValueError(f'no samples {first} to {first + count - 1}: they count up from 0')
        chunk, offset = divmod(first, _CHUNK)
        chunks = range(chunk, max(first, first + count - 1) // _CHUNK + 1)
        return Block.joined(map(self._chunk, chunks), slice(offset, offset + count))

    def settled(self, sample: int) -> bool:
        """Whether it rests from ``sample`` on, until it is told to lift off."""
        segment = self.segments[self._index(sample)]
        return segment.samples is None and segment.phase in _GROUND

    def hover(self, sample: int) -> FloatArray | None:
        """Where it hovers at ``sample`` (5,) [m, rad]; None where it moves, or does not fly."""
        state = self._state_before(sample)
        flies = self.phase(sample) in _IN_FLIGHT
        still = not (state.velocity.any() or state.acceleration.any())
        return state.position if flies and still else None

    def follow(self, first: int, motion: Motion, samples: int) -> None:
        """From sample ``first`` on, follow a motion from the hover there, and hover where it ends.

        Until it is told to land. What is followed has been checked.
        """
        segment = self.segments[self._index(first)]
        planner = Planner(self._parameters, first, segment.number + 1, self._state_before(first))
        planner.follow(motion, samples)
        self._replace(first, planner.segments)

    def lift_off(self, first: int, rest: FloatArray) -> bool:
        """Start at sample ``first`` from rest at ``rest`` (5,), the first time or after a landing.

        Returns False when it has started already. Raises UnreachableError where the platen cannot
        lift off from there; it then goes on resting.
        """
        segment = self.segments[self._index(first)]
        if not self.settled(first):
            return False
        start = State.at_rest(self._rest_position(rest))
        planner = self._full_plan(start, first, segment.number + 1)
        before = self.segments
        self._replace(first, planner.segments)
        try:
            self._check_way_up(first)
        except UnreachableError:
            self._adopt(before)
            raise
        self._at_rest = start
        return True

    def abandon(self, first: int) -> bool:
        """Want no current from sample ``first`` on: REST before a lift-off, END in flight.

        Whoever held the platen up must have seen to its landing. Returns False when it rests.
        """
        if self.settled(first):
            return False
        segment = self.segments[self._index(max(first - 1, 0))]
        planner = Planner(self._parameters, first, segment.number + 1, self._at_rest)
        if segment.phase == Phase.REST:
            planner.rest()
        else:
            planner.end()
        self._replace(first, planner.segments)
        return True

    def land(self, first: int) -> bool:
        """From sample ``first`` on, land smoothly from wherever the reference then is, then END.

        Returns False when it has already landed or is about to.
        """
        segment = self.segments[self._index(first)]
        if segment.phase in (Phase.LAND, Phase.END):
            return False
        planner = Planner(self._parameters, first, segment.number + 1, self._state_before(first))
        if segment.phase == Phase.REST:
            planner.end()
        else:
            planner.brake()
            planner.land()
        self._replace(first, planner.segments)
        return True

    def _rest_position(self, rest: FloatArray | None) -> FloatArray:
        table = self._parameters.lift_off
        if rest is None:
            return np.array([table.rest_gap, 0.0, 0.0, 0.0, 0.0])
        position = np.array(rest, dtype=float)
        if position.shape != (5,):
            raise ValueError(f'a rest position has shape (5,), not {position.shape}')
        upper = self._parameters.limits.upper[Y]
        if position[Y] > upper and position[Y] - upper <= table.rest_tolerance:
            position[Y] = upper
        check_rest(position, self._parameters)
        return position

    def _full_plan(self, state: State, first: int, number: int) -> Planner:
        planner = Planner(self._parameters, first, number, state)
        planner.lift_off()
        planner.measure(self._measured)
        planner.land()
        return planner

    def _state_before(self, sample: int) -> State:
        """The state a new segment takes over at ``sample``: of what was there, without its jump."""
        segment = self.segments[self._index(sample)]
        if segment.jumps and segment.first == sample:
            segment = self.segments[self._index(sample - 1)]
        time = (sample - segment.first) * self._parameters.sample_time
        return state_at(segment.motion, time)

    def _adopt(self, segments: list[Segment]) -> None:
        self.segments = list(segments)
        """In order; the last one has no end."""
        self._firsts = [segment.first for segment in self.segments]
        self._cached_chunk = -1

    def _replace(self, first: int, segments: list[Segment]) -> None:
        kept = [segment for segment in self.segments if segment.first < first]
        if kept:
            kept[-1] = kept[-1]._replace(samples=first - kept[-1].first)
        self._adopt(kept + segments)

    def _index(self, sample: int) -> int:
        return bisect.bisect_right(self._firsts, sample) - 1

    def _chunk(self, chunk: int) -> Block:
        if chunk != self._cached_chunk or self._cache is None:
            self._cache = self._evaluate(chunk * _CHUNK, _CHUNK)
            self._cached_chunk = chunk
        return self._cache

    def _evaluate(self, first: int, count: int) -> Block:
        pieces, stop = [], first + count
        for segment in self.segments[self._index(first) : self._index(stop - 1) + 1]:
            begin, end = max(first, segment.first), min(stop, segment.last + 1)
            time = np.arange(begin - segment.first, end - segment.first, dtype=np.float64)
            moved = segment.motion.evaluate(self._parameters.sample_time * time)
            phase = np.full(len(time), segment.phase, np.uint8)
            number = np.full(len(time), segment.number, np.uint32)
            target = np.tile(segment.target, (len(time), 1))
            pieces.append(Block(phase, number, *moved, target))
        return Block.joined(pieces)

    def _check(self) -> None:
        """What is measured first, so that it and not the way to it is found at fault."""
        end = self.segments[-1].first
        for segment in sorted(self.segments, key=lambda segment: segment.phase not in _MEASURED):
            last = min(segment.last, end)
            if isinstance(segment.motion, Stand):  # a sample is as the one before
                last = min(last, segment.first + 1)
            self._check_range(max(segment.first - 1, 0), last + 1)

    def _check_way_up(self, first: int) -> None:
        """From sample ``first`` to what is measured; that has been checked, and what follows."""
        stop = next(
            each.first for each in self.segments if each.first > first and each.phase in _MEASURED
        )
        self._check_range(first, stop)

    def _check_range(self, first: int, stop: int) -> None:
        sample_time = self._parameters.sample_time
        jumps_at = [segment.first for segment in self.segments if segment.jumps]
        for start in range(first, stop, _CHECKED_TOGETHER):
            count = min(_CHECKED_TOGETHER + 1, stop - start)  # one more, to see the seam
            block = self._evaluate(start, count)
            samples = Kinematics(block.position, block.velocity, block.acceleration)
            jumps = np.isin(np.arange(start, start + count), jumps_at)
            measured = np.isin(block.phase, _MEASURED)
            check_locked(block.position, measured, start * sample_time, self._parameters)
            check_samples(samples, start * sample_time, self._parameters, jumps)
            check_currents(samples, start * sample_time, self._parameters)
