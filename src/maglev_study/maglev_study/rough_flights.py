"""Two laws on a rough plant: the ellipse, slow scans, holds; true and measured errors apart.

An internal model hides on an ellipse what repeats with position; slow scans and holds show it.
``python benchmarks/rough.py`` prints what is found here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import MeasurementFault
from maglev_model.axes import FloatArray
from maglev_model.parameters import from_yaml, replace
from maglev_monitor.metrics.repeatability import Repeatability, repeatability
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage
from maglev_study.closed_loop import Run, regulator_at_start, run
from maglev_study.references import HOVER, References, ellipse, held, joined, scan, shaped

THETA = 0.010
"""Amplitude of the ellipse in 4DOF [rad]."""

SPEEDS = (0.001, 0.002, 0.005)
"""Of the slow scans [m/s]."""

HUNTING = np.array([3e-6, 3e-6, 3e-6, 15e-6, 15e-6])
"""Rms movement about its mean from which on a hold is said to hunt [m, rad]."""

FRICTIONS = ('lugre', 'coulomb', 'tanh')
"""Of the guides of machines that are drawn, in turn."""

_ASIDE = 0.002  # centre of mass of these [m]
_SETTLE, _RUN_IN = 3.0, 10.0  # [s]
_SCAN_WAY = np.array([0.001, 0.005, 0.005, 0.0, 0.0])  # to each side [m, rad]
_SCAN_SHARE = np.array([0.2, 1.0, 1.0, 0.0, 0.0])  # of the speed
_SPAN = np.array([0.003, 0.02, 0.02, 0.001, 0.006])  # places of holds, to each side
_LOST = 2e-3  # error with which a platen is lost [m, rad]


@dataclasses.dataclass(frozen=True)
class Errors:
    """Errors of one source, each (5,) by axis y, x, z, phi, theta [m, rad]."""

    mean: FloatArray  # of |e|
    peak: FloatArray  # of |e|
    bias: FloatArray  # mean of e
    movement: FloatArray  # rms of e about its mean

    @property
    def rms(self) -> FloatArray:
        """Of e, (5,)."""
        found: FloatArray = np.hypot(self.bias, self.movement)
        return found

    @classmethod
    def of(cls, error: FloatArray) -> Errors:
        """Of errors (n, 5)."""
        size = np.abs(error)
        return cls(size.mean(axis=0), size.max(axis=0), error.mean(axis=0), error.std(axis=0))


@dataclasses.dataclass(frozen=True)
class Outcome:
    """A flight: what it is called, errors by source, or why there are none."""

    name: str
    true: Errors | None = None
    own: Errors | None = None  # of the position on the encoders' own scales
    measured: Errors | None = None
    lost: str = ''

    @property
    def hunting(self) -> bool:
        """Whether the true position moves more than a hold should."""
        return self.true is not None and bool(np.any(self.true.movement > HUNTING))


@dataclasses.dataclass(frozen=True)
class Experiment:
    """A reference from rest at 25 mm; errors count in the last ``measured`` seconds."""

    name: str
    references: References
    measured: float


def experiments(period: float, hold: float = 60.0, places: int = 3) -> Iterator[Experiment]:
    """The ellipse in 4DOF, scans at 1 to 5 mm/s and holds, a sample every ``period`` [s]."""
    course = ellipse(_RUN_IN + 20.0, THETA, period, grow=2.0)
    yield Experiment('ellipse', course, 20.0)
    for speed in SPEEDS:
        moving = scan(_SCAN_WAY, speed * _SCAN_SHARE, 2, period)
        start = shaped(HOVER, moving.position[0], 0.5, _SETTLE, period)
        name = f'scan {1e3 * speed:g} mm/s'
        yield Experiment(name, joined(start, moving), period * len(moving.position))
    rng = np.random.default_rng(5)
    for number in range(1, places + 1):
        goal = HOVER + _SPAN * rng.uniform(-1.0, 1.0, 5)
        course = joined(shaped(HOVER, goal, 1.0, _SETTLE, period), held(goal, hold, period))
        yield Experiment(f'hold {number}', course, hold)


def positioning(
    plant: PlantParameters, controller: ControllerParameters, axis: int, rounds: int = 5
) -> dict[str, Repeatability] | None:
    """Repeatability of one axis, of the true position and on the encoders' own scale.

    Five targets over the middle of travel, approached from below and above in ``rounds``; None when
    the platen is lost. A deviation is the mean over 0.1 s, 0.9 s after the move.
    """
    period, targets = plant.sample_time, np.linspace(-0.8, 0.8, 5)
    course = np.tile(np.concatenate([[-1.0], targets, [1.0], targets[::-1]]), rounds)
    place = HOVER + np.outer(course, _SPAN * (np.arange(5) == axis))
    starts = np.vstack([HOVER, place[:-1]])
    parts = [shaped(a, b, 0.5, 1.0, period) for a, b in zip(starts, place, strict=True)]
    try:
        outcome = flown(plant, controller, joined(*parts))
    except MeasurementFault:
        return None
    n, tail = round(1.5 / period), round(0.1 / period)
    found = {}
    for name, position in (('true', outcome.output), ('own', outcome.own)):
        rest = position[:, axis].reshape(len(course), n)[:, -tail:].mean(axis=1) - place[:, axis]
        passes = rest.reshape(rounds, 12)
        found[name] = repeatability(passes[:, 1:6].T, passes[:, :6:-1].T)
    return found


def flown(plant: PlantParameters, controller: ControllerParameters, references: References) -> Run:
    """A law on a plant, begun at rest at 25 mm; MeasurementFault where the platen is given up."""
    stage = SimulatedStage(replace(plant, {'initial.position': tuple(HOVER)}))
    return run(regulator_at_start(controller), stage, references)


def fly_rough(
    plant: PlantParameters, controller: ControllerParameters, experiment: Experiment
) -> Outcome:
    """One flight of a law on a plant, begun at rest at 25 mm."""
    try:
        outcome = flown(plant, controller, experiment.references)
    except MeasurementFault as fault:
        return Outcome(experiment.name, lost=str(fault))
    period = plant.sample_time
    n = round(experiment.measured / period)
    wanted = experiment.references.position
    sources = (outcome.output, outcome.own, outcome.measured)
    true, own, measured = (position[-n:] - wanted[-n:] for position in sources)
    far = np.flatnonzero(np.abs(true).max(axis=1) > _LOST)
    if far.size:
        return Outcome(experiment.name, lost=f'2 mm or 2 mrad off at {period * far[0]:.3f} s')
    return Outcome(experiment.name, Errors.of(true), Errors.of(own), Errors.of(measured))


def laws(params: Path, *overlays: str) -> dict[str, ControllerParameters]:
    """The default law, and the paper's on the exact inverse, from the folder of parameters.

    Both are told what the overlays, by name, say of the machine.
    """
    names = {
        'default law': ('controller', *overlays),
        "paper's law": ('controller', 'paper', 'paper_exact', *overlays),
    }
    return {
        law: from_yaml(ControllerParameters, 'controller', *(params / f'{n}.yaml' for n in files))
        for law, files in names.items()
    }


def plant_of(params: Path, *overlays: str, **overrides: object) -> PlantParameters:
    """The benchmark plant with overlays by name; single parameters with dots as ``__``."""
    files = [params / f'{name}.yaml' for name in ('machine', 'benchmark', *overlays)]
    named: Mapping[str, object] = {k.replace('__', '.'): v for k, v in overrides.items()}
    return replace(from_yaml(PlantParameters, 'plant', *files), named)


def machines(params: Path, count: int) -> Iterator[PlantParameters]:
    """Rough plants, drawn from seed 0 on: motors, phases and amplifiers as ``rough.yaml`` says.

    The centre of mass is 2 mm aside whichever way; the frictions take turns.
    """
    for seed in range(count):
        way = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi)
        yield plant_of(
            params,
            'rough',
            seed=seed,
            effects__friction__model=FRICTIONS[seed % len(FRICTIONS)],
            effects__balance__aside_x=_ASIDE * float(np.cos(way)),
            effects__balance__aside_z=_ASIDE * float(np.sin(way)),
        )
