"""One law in flight: approach a set-point, then run an experiment from there."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_controller.regulator import MeasurementFault
from maglev_model.axes import FloatArray
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import LawFault, Run, at_stops, regulator_at_start, run
from maglev_study.comparison.contestants import Contestant
from maglev_study.references import HOVER, References, held, shaped

SETTLED = 1e-4
"""Error below which a step has settled [m, rad], the paper's t_s."""

ENCODER = (1e-5, 1e-5, 1e-5, 2e-5, 2e-5)
"""Resolution of the encoders [m, rad], the paper's t_enc."""


class Step(NamedTuple):
    """A step response as the paper judges it; ``settling`` is infinite when it does not settle."""

    overshoot: float  # [%]
    settling: float  # error goes and stays below the bound [s]


class Flight:
    """A stage that hovers at 25 mm, and the regulator that carries it.

    Flights of one law share its regulator, which begins anew with each: one at a time.
    """

    def __init__(self, contestant: Contestant, **overrides: object) -> None:
        """``overrides`` are the stage's, dots written as ``__``."""
        parameters = contestant.stage(initial__position=tuple(HOVER), **overrides)
        self.period = parameters.sample_time
        self.regulator = regulator_at_start(contestant.controller)
        self.stage = SimulatedStage(parameters)
        self._at_stop = at_stops(parameters)
        self.seat_radius = parameters.stop.seat_radius
        self.lost = ''  # how the platen was, where it was

    def follow(self, references: References) -> Run | None:
        """Carry on along a reference; None when the platen meets a stop, or is given up."""
        try:
            outcome = run(self.regulator, self.stage, references)
        except (MeasurementFault, LawFault) as fault:
            self.lost = str(fault)
            return None
        met = np.flatnonzero(self._at_stop(outcome.output))
        if met.size:
            self.lost = f'sample {met[0]}: the platen meets a stop'
            return None
        return outcome

    def approach(self, goal: FloatArray, time: float = 4.0, hold: float = 5.0) -> bool:
        """Go from 25 mm to a set-point (5,) in ``time`` [s] and hold it; false when that fails."""
        return self.follow(shaped(HOVER, goal, time, hold, self.period)) is not None

    def save(self) -> tuple[NDArray[Any], ...]:
        """All that changes with time, for :meth:`restore`."""
        return self.stage.arrays.block.copy(), *self.regulator.save()

    def restore(self, saved: tuple[NDArray[Any], ...]) -> None:
        """Go back to what was saved."""
        self.stage.arrays.block[:] = saved[0]
        self.regulator.restore(saved[1:])

    def begin_step(self) -> None:
        """What a law that is to begin every step anew does before it."""
        if self.regulator.parameters.internal_model.restart_at_step:
            self.regulator.reset(in_flight=True)

    def step(self, begin: FloatArray, target: FloatArray, time: float, hold: float) -> Run | None:
        """A step from the set-point ``begin`` to ``target`` (5,), raw for ``time`` 0 [s].

        Lasts ``hold`` [s] in all; None when the platen is lost.
        """
        self.begin_step()
        if time > 0.0:
            return self.follow(shaped(begin, target, time, hold - time, self.period))
        return self.follow(held(target, hold, self.period))


def judge(response: FloatArray, start: float, end: float, bound: float, period: float) -> Step:
    """Overshoot of a response (n,) that begins with the step, and when it settles to ``bound``."""
    outside = np.nonzero(np.abs(response - end) > bound)[0]
    settling = period * (float(outside[-1]) + 1.0) if outside.size else 0.0
    if outside.size and outside[-1] == response.size - 1:
        settling = math.inf
    return Step(max(0.0, 100.0 * float(np.max((response - end) / (end - start)))), settling)
