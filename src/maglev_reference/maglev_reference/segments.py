"""Segments, the pieces of a reference, and the planner that lines them up without a jump."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from maglev_model.axes import PHI, FloatArray, Y
from maglev_model.contract.phases import Phase
from maglev_model.quintic import coasted, minimum_jerk_time
from maglev_reference.check import utilisation, within
from maglev_reference.currents import current_utilisation
from maglev_reference.motion import Motion, Quintic, Stand, State, state_at
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.trajectories import Course, Delayed, Step

_STRETCH = 1.25  # from one tried move time to the next
_TRIALS = 24
_GRID = 201  # points at which a tried move is checked
_BRAKING_MARGIN = 0.1  # of the range, that a braking platen keeps away from its limits
_UNDONE = np.array([5.0, 5.0, 5.0, 20.0, 20.0])  # acceleration, at most [m/s^2, rad/s^2]
_SAMPLE_MAX = 2**62


class Segment(NamedTuple):
    """``samples`` samples from ``first`` on; None is for ever.

    ``target`` (5,) is the set-point at the segment's end; ``jumps`` tells that the position may
    jump at the first sample (a raw step).
    """

    first: int
    samples: int | None
    number: int
    phase: Phase
    motion: Motion
    target: FloatArray
    jumps: bool = False

    @property
    def last(self) -> int:
        """The last sample of the segment."""
        return _SAMPLE_MAX if self.samples is None else self.first + self.samples - 1


class Planner:
    """Appends segments, each from the state in which the one before it ends.

    ``first`` is the sample the first segment begins at, ``number`` its segment number and ``state``
    the state there.
    """

    def __init__(
        self, parameters: ReferenceParameters, first: int, number: int, state: State
    ) -> None:
        self.segments: list[Segment] = []
        self._parameters = parameters
        self._sample = first
        self._number = number
        self._state = state

    def lift_off(self) -> None:
        """REST, LIFT_OFF straight up to the home gap, HOLD at home.

        Where the platen rests a little beside home, it gets there while it rises.
        """
        table = self._parameters.lift_off
        home = np.array(self._parameters.home)
        self._stand(Phase.REST, max(table.wait, self._parameters.sample_time))
        beside = np.abs(self._state.position - home) > table.rest_tolerance
        above = np.where(beside, self._state.position, home)
        above[Y] = home[Y]
        above[PHI:] = 0.0
        self._move(Phase.LIFT_OFF, State.at_rest(above), table.time)
        self._move_to(home)
        self._stand(Phase.HOLD, table.settle)

    def measure(self, measured: Course | list[Step]) -> None:
        """The measured part: TRACK on the trajectory, or every STEP; then HOLD back at home."""
        parameters = self._parameters
        if isinstance(measured, list):
            for step in measured:
                self._move_to(step.start)
                self._stand(Phase.HOLD, parameters.steps.settle)
                self._follow(Phase.STEP, step.motion, parameters.duration, jumps=step.jumps)
        else:
            path = measured.motion
            run_in = self._samples(parameters.run_in) * parameters.sample_time
            self._move(Phase.HOLD, state_at(path, -run_in), parameters.move_time)
            if run_in > 0.0:
                self._follow(Phase.HOLD, Delayed(path, -run_in), run_in)
            self._follow(Phase.TRACK, path, parameters.duration)
        self._move_to(np.array(parameters.home))

    def brake(self) -> None:
        """LAND: come to rest, level and nearby, away from the upper stop and from the limits.

        An acceleration that would take too much to undo smoothly is let go at once.
        """
        bend = np.clip(self._state.acceleration, -_UNDONE, _UNDONE)
        self._state = start = self._state._replace(acceleration=bend)
        limits = self._parameters.limits
        lower, upper = np.array(limits.lower), np.array(limits.upper)
        margin = _BRAKING_MARGIN * (upper - lower)
        lower, upper = lower + margin, upper - margin
        lower[Y], upper[Y] = self._parameters.home[Y], self._parameters.lift_off.rest_gap

        def rest(duration: float) -> State:
            way = coasted(start.velocity, start.acceleration, np.asarray(duration))
            point = np.clip(start.position + way, lower, upper)
            point[PHI:] = 0.0
            return State.at_rest(point)

        self._search(Phase.LAND, rest, self._parameters.landing.brake_time, best=True)

    def land(self) -> None:
        """LAND straight down from rest to the lower stop, with a crawl at the end; then END."""
        table = self._parameters.landing
        stop = self._state.position.copy()
        stop[Y] = self._parameters.lift_off.rest_gap
        if stop[Y] - self._state.position[Y] > 2.0 * table.crawl_distance:
            crawl = State.at_rest(stop)
            crawl.position[Y] -= table.crawl_distance
            crawl.velocity[Y] = table.crawl_speed
            self._move(Phase.LAND, crawl, table.time, target=stop)
            # from v_0 to rest over v_0 T / 2 the speed falls monotonically
            count = max(1, self._samples(2.0 * table.crawl_distance / table.crawl_speed))
            duration = count * self._parameters.sample_time
            self._append(Phase.LAND, Quintic(self._state, State.at_rest(stop), duration), count)
        else:
            self._move(Phase.LAND, State.at_rest(stop), table.time)
        self.end()

    def end(self) -> None:
        """END for ever where the platen is."""
        self._append(Phase.END, Stand(self._state.position), None)

    def follow(self, motion: Motion, samples: int) -> None:
        """TRACK along a motion that ends at rest, then HOLD for ever where it ends."""
        self._append(Phase.TRACK, motion, samples)
        self._append(Phase.HOLD, Stand(self._state.position), None)

    def rest(self) -> None:
        """REST for ever where the platen is."""
        self._append(Phase.REST, Stand(self._state.position), None)

    def _samples(self, duration: float) -> int:
        return round(duration / self._parameters.sample_time)

    def _append(
        self,
        phase: Phase,
        motion: Motion,
        count: int | None,
        target: FloatArray | None = None,
        jumps: bool = False,
    ) -> None:
        """``count`` samples of a motion, None for ever; to where it ends, or ``target`` (5,)."""
        first, number = self._sample, self._number
        if count is not None:
            self._sample += count
            self._state = state_at(motion, count * self._parameters.sample_time)
        self._number += 1
        target = np.array(self._state.position if target is None else target)
        self.segments.append(Segment(first, count, number, phase, motion, target, jumps))

    def _stand(self, phase: Phase, duration: float) -> None:
        count = self._samples(duration)
        if count > 0:
            self._append(phase, Stand(self._state.position), count)

    def _follow(self, phase: Phase, motion: Motion, duration: float, jumps: bool = False) -> None:
        self._append(phase, motion, max(1, self._samples(duration)), jumps=jumps)

    def _move_to(self, position: FloatArray) -> None:
        """HOLD while moving to rest at a position (5,); nothing when already there."""
        there = np.array_equal(self._state.position, position)
        if not there or self._state.velocity.any() or self._state.acceleration.any():
            self._move(Phase.HOLD, State.at_rest(position), self._parameters.move_time)

    def _move(
        self, phase: Phase, end: State, duration: float, target: FloatArray | None = None
    ) -> None:
        self._search(phase, lambda _: end, duration, target)

    def _search(
        self,
        phase: Phase,
        end: Callable[[float], State],
        duration: float,
        target: FloatArray | None = None,
        best: bool = False,
    ) -> None:
        """Append the first move within limits, of ``duration`` or longer, else shorter.

        With ``best`` the one that offends least is taken where none is within, by its currents
        rather than by where it leads; otherwise the one of ``duration`` is, and the check of the
        whole reference says what is wrong with it.
        """
        chosen: tuple[tuple[float, ...], Quintic, int] | None = None
        for trial in self._trial_times(end(duration), duration):
            count = max(1, self._samples(trial))
            time = count * self._parameters.sample_time
            motion = Quintic(self._state, end(time), time)
            samples = motion.evaluate(np.linspace(0.0, time, _GRID))
            of_limits = utilisation(samples, self._parameters)
            used = max(of_limits, current_utilisation(samples, self._parameters))
            offence = max(of_limits, 1.0), used, of_limits
            if chosen is None or within(used) or (best and offence < chosen[0]):
                chosen = (offence, motion, count)
            if within(used):
                break
        assert chosen is not None
        _, motion, count = chosen
        self._append(phase, motion, count, target)

    def _trial_times(self, end: State, duration: float) -> Iterator[float]:
        limits = self._parameters.limits
        way, step = end.position - self._state.position, self._parameters.sample_time
        shortest = max(map(minimum_jerk_time, way, limits.velocity, limits.acceleration))
        first = max(duration, np.ceil(shortest / step) * step)
        longer = (first * _STRETCH**power for power in range(_TRIALS))
        shorter = (first * _STRETCH**-power for power in range(1, _TRIALS // 2))
        return itertools.chain(longer, shorter)
