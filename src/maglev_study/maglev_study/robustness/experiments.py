"""What every machine flies: the ellipse, also under forces, shaped steps, a slow scan, a hold."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Collection, Mapping

import numpy as np

from maglev_model.axes import AXES, FloatArray
from maglev_model.paper import TRACKING
from maglev_study.comparison.experiments import DISTURBANCE, GROW, SHAPED_STEPS, StepExperiment
from maglev_study.references import HOVER, References, confined, ellipse, shaped
from maglev_study.rough_flights import THETA as ELLIPSE_THETA
from maglev_study.rough_flights import experiments as rough_experiments

_RUN_IN, _MEASURED = 10.0, 20.0  # of ellipses; of holds the second [s]
_APPROACH, _REST, _STEP = 4.0, 5.0, 6.0  # to where a step begins, held there, of the step [s]
ALL = (True,) * len(AXES)
"""Axes, all of which move."""


@dataclasses.dataclass(frozen=True)
class Experiment:
    """A reference from rest at 25 mm, or from where ``approach`` ends.

    Errors count in its last ``measured`` seconds. ``plant`` is changed in the stage, dots as
    ``__``; ``published`` is mean |e| on the paper's machine by axis [m, rad].
    """

    name: str
    references: References
    measured: float
    approach: References | None = None
    step: StepExperiment | None = None
    plant: Mapping[str, object] = dataclasses.field(default_factory=dict)
    published: Mapping[str, float] = dataclasses.field(default_factory=dict)


@functools.lru_cache(maxsize=4)
def experiments(period: float, moves: tuple[bool, ...] = ALL) -> tuple[Experiment, ...]:
    """All of them, a sample every ``period`` [s]; only what ``moves``, by axis, is asked to."""
    course = ellipse(_RUN_IN + _MEASURED, ELLIPSE_THETA, period, grow=GROW)
    rough = {one.name: one for one in rough_experiments(period, hold=_MEASURED, places=1)}
    scan, hold = rough['scan 2 mm/s'], rough['hold 1']
    steps = {step.axis: step for step in reversed(SHAPED_STEPS)}
    found = [
        Experiment('ellipse', course, _MEASURED, published=TRACKING['ellipse_4dof'].mean_error),
        Experiment('forces', course, _MEASURED, plant=DISTURBANCE),
        *(_step(steps[axis], period) for axis in sorted(steps)),
        Experiment('scan', scan.references, scan.measured),
        Experiment('hold', hold.references, hold.measured),
    ]
    return tuple(
        dataclasses.replace(one, references=confined(one.references, moves))
        for one in found
        if one.step is None or moves[one.step.axis]
    )


def chosen(
    period: float, moves: tuple[bool, ...] = ALL, names: Collection[str] = ()
) -> tuple[Experiment, ...]:
    """Those of some ``names`` that there are, all for none; arguments as of :func:`experiments`."""
    found = experiments(period, moves)
    return tuple(one for one in found if one.name in names) if names else found


def _step(step: StepExperiment, period: float) -> Experiment:
    start, target = (_beside(step.axis, value) for value in (step.start, step.end))
    return Experiment(
        f'step_{AXES[step.axis]}',
        shaped(start, target, step.time, _STEP - step.time, period),
        _STEP,
        approach=shaped(HOVER, start, _APPROACH, _REST, period),
        step=step,
    )


def _beside(axis: int, value: float) -> FloatArray:
    place = np.array(HOVER)
    place[axis] = value
    return place
