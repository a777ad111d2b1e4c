"""One machine under one law through all experiments: what came of each, in a few figures."""

from __future__ import annotations

import base64
import dataclasses
import math
import threading
from collections.abc import Collection
from typing import Any

import numpy as np

from maglev_model.axes import FloatArray
from maglev_study.closed_loop import Run
from maglev_study.comparison.contestants import Contestant
from maglev_study.comparison.flight import SETTLED, Flight, Step, judge
from maglev_study.robustness.draw import Machine
from maglev_study.robustness.experiments import Experiment, chosen

BINS = 50
"""Parts of the measured time for each of which the largest errors are kept."""

FLOWN, UNSETTLED, LOST = 'flown', 'unsettled', 'lost'
"""Verdicts: it flew; a step did not settle to 0.1 mm or mrad; it met a stop, or was given up."""

_NONE = np.full(5, np.nan)
_one_at_a_time = threading.Lock()  # flights of one process share their law's regulator


@dataclasses.dataclass(frozen=True)
class Flown:
    """What came of one experiment.

    ``mean``, ``peak`` and ``rms`` (5,) of the error by axis y, x, z, phi, theta [m, rad], of the
    position on the encoders' own scales; ``overshoot`` [%] and ``settling`` [s] of a step; NaN
    where there is none. ``envelope`` (:data:`BINS`, 5) the largest |e| of each part of the measured
    time, empty when it was lost; then ``reason`` says how.
    """

    machine: int
    law: str
    experiment: str
    verdict: str
    reason: str = ''
    mean: FloatArray = dataclasses.field(default_factory=_NONE.copy)
    peak: FloatArray = dataclasses.field(default_factory=_NONE.copy)
    rms: FloatArray = dataclasses.field(default_factory=_NONE.copy)
    overshoot: float = math.nan
    settling: float = math.nan
    envelope: FloatArray = dataclasses.field(default_factory=lambda: np.empty((0, 5)))

    def to_json(self) -> dict[str, Any]:
        """As plain values, exactly; the envelope in single precision."""
        plain: dict[str, Any] = {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(self).items()
        }
        envelope = self.envelope.astype('<f4').tobytes()
        return {**plain, 'envelope': base64.b64encode(envelope).decode('ascii')}

    @classmethod
    def from_json(cls, plain: dict[str, Any]) -> Flown:
        """What :meth:`to_json` wrote."""
        envelope = np.frombuffer(base64.b64decode(plain['envelope']), '<f4').reshape(-1, 5)
        arrays = {name: np.array(plain[name]) for name in ('mean', 'peak', 'rms')}
        return cls(**{**plain, **arrays, 'envelope': envelope.astype(np.float64)})


def fly(machine: Machine, contestant: Contestant, names: Collection[str] = ()) -> list[Flown]:
    """A drawn machine under a law, through the experiments of some ``names``, or through all."""
    flown = dataclasses.replace(contestant, plant=machine.plant)
    found = chosen(machine.plant.sample_time, contestant.moves, names)
    with _one_at_a_time:
        return [_fly(machine.number, flown, experiment) for experiment in found]


def _fly(number: int, contestant: Contestant, experiment: Experiment) -> Flown:
    flight = Flight(contestant, **experiment.plant)
    said: dict[str, Any] = {
        'machine': number,
        'law': contestant.name,
        'experiment': experiment.name,
    }
    if experiment.approach is not None:
        if flight.follow(experiment.approach) is None:
            return Flown(**said, verdict=LOST, reason=f'before the step: {flight.lost}')
        flight.begin_step()
    run = flight.follow(experiment.references)
    if run is None:
        return Flown(**said, verdict=LOST, reason=flight.lost)
    step = _judged(experiment, run, flight.period)
    error = run.own - experiment.references.position
    size = np.abs(error[-round(experiment.measured / flight.period) :])
    return Flown(
        **said,
        verdict=UNSETTLED if math.isinf(step.settling) else FLOWN,
        mean=size.mean(axis=0),
        peak=size.max(axis=0),
        rms=np.sqrt(np.square(size).mean(axis=0)),
        overshoot=step.overshoot,
        settling=step.settling,
        envelope=np.maximum.reduceat(size, np.linspace(0, len(size), BINS, False, dtype=int)),
    )


def _judged(experiment: Experiment, run: Run, period: float) -> Step:
    step = experiment.step
    if step is None:
        return Step(math.nan, math.nan)
    return judge(run.own[:, step.axis], step.start, step.end, SETTLED, period)
