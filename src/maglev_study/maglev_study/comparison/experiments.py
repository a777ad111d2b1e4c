"""The experiments: steps, the ellipse, disturbances and mismatches, in the table's rows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from maglev_model.axes import AXES, THETA, FloatArray, X, Y
from maglev_study.comparison.contestants import Contestant
from maglev_study.comparison.flight import ENCODER, SETTLED, Flight, Step, judge
from maglev_study.references import HOVER, confined, ellipse

DISTURBANCE: Mapping[str, object] = {
    'disturbance__constant': (10.0, 10.0, 10.0, 1.0, 1.0),
    'disturbance__amplitude': (5.0, 5.0, 5.0, 0.5, 0.5),
    'disturbance__frequency': (0.75,) * 5,
}
"""10 N and 5 N at ω0 on y, x, z; a tenth of that in N m on the tilts."""

_FORCES = ('K_v1', 'K_v2', 'K_v3', 'K_h')
_MASSES = ('mass_y', 'mass_x', 'mass_z', 'inertia')


def _off(names: Sequence[str], factor: float) -> dict[str, object]:
    return {f'offset__{name}': factor for name in names}


MISMATCHES: tuple[Mapping[str, object], ...] = (
    _off(_FORCES, 1.1),
    _off(_FORCES, 0.9),
    _off(_MASSES, 1.1),
    _off(_MASSES, 0.9),
    _off(('K_v1',), 1.1) | _off(('K_h',), 0.9) | _off(('spring_phi', 'spring_theta'), 0.7),
    _off(('K_v1',), 0.9) | _off(('K_v2',), 1.1) | _off(('spring_phi', 'spring_theta'), 1.3),
)
"""Forces and masses 10 %, springs 30 % off, unknown to the law."""


@dataclasses.dataclass(frozen=True)
class StepExperiment:
    """A step of one axis between two of its set-points; shaped over ``time`` [s], 0 for raw.

    It settles to 0.1 mm or mrad, or with ``fine`` to the encoders' resolution.
    """

    axis: int
    start: float
    end: float
    time: float = 0.0
    fine: bool = False

    @property
    def title(self) -> str:
        """As the table's row is called."""
        unit = 'mrad' if self.axis >= 3 else 'mm'
        shape = f', in {self.time:g} s' if self.time else ''
        return f'{AXES[self.axis]} {1e3 * self.start:g} -> {1e3 * self.end:g} {unit}{shape}'


SMALL_STEPS = (
    StepExperiment(Y, 0.025, 0.0252, fine=True),
    StepExperiment(X, 0.0, 0.0002, fine=True),
    StepExperiment(THETA, 0.0, 0.0002, fine=True),
)
LARGE_STEPS = (
    StepExperiment(Y, 0.020, 0.027),
    StepExperiment(Y, 0.030, 0.020),
    StepExperiment(X, 0.0, 0.030),
    StepExperiment(THETA, 0.0, 0.010),
)
SHAPED_STEPS = tuple(dataclasses.replace(step, time=0.2) for step in LARGE_STEPS)

GROW = 2.0
"""Time in which the ellipse grows from standing still [s]."""

LOST, NOT_SETTLED, NONE = 'lost', 'unsettled', '-'


@dataclasses.dataclass(frozen=True)
class Row:
    """One row of the table for one law."""

    section: str
    title: str
    text: str
    values: tuple[float, ...]


def loops(contestant: Contestant) -> list[Row]:
    """Crossover and phase margin of every loop, as designed."""
    regulator = Flight(contestant).regulator
    margins = regulator.margins
    shown = [margins[axis] for axis in (Y, X, THETA) if contestant.moves[axis]]
    section = 'the loops as designed, y/x/theta'
    rows = []
    for title, values in (
        ('crossover [rad/s]', tuple(found.crossover for found in shown)),
        ('phase margin [deg]', tuple(found.phase for found in shown)),
    ):
        text = '/'.join(f'{value:.0f}' for value in values)
        known = regulator.foreign is None  # the margins are those of what lands in its place
        rows.append(Row(section, title, text, values) if known else Row(section, title, NONE, ()))
    return rows


def steps(contestant: Contestant) -> list[Row]:
    """Overshoot and t_s of every step, each from rest."""
    rows = []
    for section, experiments in (
        ('small steps: overshoot, t_enc', SMALL_STEPS),
        ('large steps: overshoot, t_s', LARGE_STEPS),
        ('the same, shaped', SHAPED_STEPS),
    ):
        for experiment in experiments:
            rows.append(_step_row(contestant, section, experiment, ({},)))
    return rows


def tracking(contestant: Contestant, measured: float) -> list[Row]:
    """Mean errors over ``measured`` [s] of the ellipse: undisturbed, disturbed and mismatched."""
    nothing: Mapping[str, object] = {}
    rows = [
        _ellipse_row(contestant, '3DOF', 0.0, (nothing,), measured),
        _ellipse_row(contestant, '4DOF', 0.010, (nothing,), measured),
        _ellipse_row(contestant, '3DOF, forces', 0.0, (DISTURBANCE,), measured),
        _ellipse_row(contestant, '4DOF, forces', 0.010, (DISTURBANCE,), measured),
        _ellipse_row(contestant, '3DOF, mismatches', 0.0, MISMATCHES, measured),
        _ellipse_row(contestant, '4DOF, mismatches', 0.010, MISMATCHES, measured),
    ]
    mismatched = StepExperiment(Y, 0.025, 0.027)
    rows.append(_step_row(contestant, 'mismatches, worst: overshoot, t_s', mismatched, MISMATCHES))
    return rows


def _step_row(
    contestant: Contestant,
    section: str,
    experiment: StepExperiment,
    plants: Sequence[Mapping[str, object]],
) -> Row:
    if not contestant.moves[experiment.axis]:
        return Row(section, experiment.title, NONE, ())
    target, start = HOVER.copy(), HOVER.copy()
    target[experiment.axis], start[experiment.axis] = experiment.end, experiment.start
    worst = (0.0, 0.0)
    for plant in plants:
        result = _fly_step(Flight(contestant, **plant), experiment, start, target)
        worst = max(worst[0], result.overshoot), max(worst[1], result.settling)
    text = f'{worst[0]:.1f} % {worst[1]:.2f} s'
    if math.isinf(worst[1]):
        text = LOST if math.isinf(worst[0]) else f'{worst[0]:.1f} % {NOT_SETTLED}'
    return Row(section, experiment.title, text, worst)


def _fly_step(
    flight: Flight, experiment: StepExperiment, start: FloatArray, target: FloatArray
) -> Step:
    axis = experiment.axis
    outcome = None
    if flight.approach(start):
        outcome = flight.step(start, target, experiment.time, 6.0)
    if outcome is None:
        return Step(math.inf, math.inf)
    bound = ENCODER[axis] if experiment.fine else SETTLED
    response = outcome.output[:, axis]
    return judge(response, experiment.start, experiment.end, bound, flight.period)


def _ellipse_row(
    contestant: Contestant,
    title: str,
    theta: float,
    plants: Sequence[Mapping[str, object]],
    measured: float,
) -> Row:
    section = 'ellipse, mean |e| y/x/z [um], theta [urad]'
    if theta and not contestant.tilts:
        return Row(section, title, NONE, ())
    worst, lost = np.zeros(5), 0
    for plant in plants:
        flight = Flight(contestant, **plant)
        course = ellipse(10.0 + measured, theta, flight.period, grow=GROW)
        references = confined(course, contestant.moves)
        outcome = flight.follow(references)
        if outcome is None:
            lost += 1
            continue
        error = np.abs(outcome.output - references.position)[-round(measured / flight.period) :]
        worst = np.maximum(worst, 1e6 * error.mean(axis=0))
    shown = [worst[0], worst[1], worst[2]] + ([worst[4]] if theta else [])
    if lost:
        text = LOST if len(plants) == 1 else f'{LOST} {lost} of {len(plants)}'
        return Row(section, title, text, (math.inf,) * len(shown))
    text = '/'.join(f'{value:.1f}' if value < 100.0 else f'{value:.0f}' for value in shown)
    return Row(section, title, text, tuple(float(value) for value in shown))
