"""Regions of operation: which step a law survives from which air gap, and how fast it settles."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from maglev_model.axes import THETA, FloatArray, X, Y
from maglev_study.comparison.contestants import Contestant
from maglev_study.comparison.flight import SETTLED, Flight, judge
from maglev_study.references import HOVER

LOST = math.inf
NOT_SETTLED = -1.0

_HORIZON = 5.0  # of a step [s]
_UPPER, _LOWER = 0.01849, 0.03051  # what is aimed at stays half a millimetre off the stops


@dataclasses.dataclass(frozen=True)
class Region:
    """Raw steps of one axis at different air gaps.

    ``gap`` (n,) where they start [m]; ``size`` (m,) of the steps [m, rad]; ``settling`` (n, m): t_s
    [s], ``LOST``, ``NOT_SETTLED`` within five seconds, or NaN where there is no such step.
    """

    axis: int
    gap: FloatArray
    size: FloatArray
    settling: FloatArray


def grids(axis: int, quick: bool) -> tuple[FloatArray, FloatArray]:
    """Air gaps and step sizes that are tried."""
    gap = np.arange(19.0, 30.6, 2.0 if quick else 0.5) * 1e-3
    if axis == Y:
        up = np.array([0.5, 2.0, 5.0] if quick else [0.1, 0.2, 0.5, *range(1, 12)]) * 1e-3
        return gap, np.concatenate((-up[::-1], up))
    if axis == X:
        sizes = [0.5, 5.0, 30.0] if quick else [0.1, 0.2, 0.5, 1, 2, *range(5, 61, 5)]
    else:
        sizes = [0.5, 5.0, 10.0] if quick else [0.1, 0.2, 0.5, *range(1, 14)]
    return gap, np.array(sizes, dtype=np.float64) * 1e-3


def region(contestant: Contestant, axis: int, quick: bool) -> Region:
    """Fly all steps of an axis; x steps start at -30 mm, tilts at 0. Tilts may be out of reach."""
    gap, size = grids(axis, quick)
    settling = np.full((gap.size, size.size), np.nan)
    if contestant.moves[axis]:
        flight = Flight(contestant)
        hover = flight.save()
        for row, start in enumerate(gap):
            flight.restore(hover)
            flight.regulator.reset()
            settling[row] = _from_gap(flight, axis, float(start), size)
    return Region(axis, gap, size, settling)


def _from_gap(flight: Flight, axis: int, gap: float, sizes: FloatArray) -> FloatArray:
    begin = HOVER.copy()
    begin[Y] = gap
    if axis == X:
        begin[X] = -0.030
    found = np.full(sizes.size, np.nan)
    reached = flight.approach(begin, hold=4.0)
    ready = flight.save()
    for column, size in enumerate(sizes):
        target = begin.copy()
        target[axis] += size
        reach = flight.seat_radius * abs(target[THETA])
        if target[Y] - reach < _UPPER or target[Y] + reach > _LOWER:
            continue
        found[column] = LOST
        if not reached:
            continue
        flight.restore(ready)
        outcome = flight.step(begin, target, 0.0, _HORIZON)
        if outcome is not None:
            response = outcome.output[:, axis]
            result = judge(
                response, float(begin[axis]), float(target[axis]), SETTLED, flight.period
            )
            found[column] = NOT_SETTLED if math.isinf(result.settling) else result.settling
    return found
