"""What the flights of a campaign amount to: who survives, quantiles, what matters, who is worst."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from maglev_model.axes import AXES, FloatArray
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.experiments import Experiment
from maglev_study.robustness.fleet import Campaign
from maglev_study.robustness.fly import LOST, UNSETTLED, Flown

SHARES = (0.05, 0.5, 0.95)
"""Of the machines, by which quantiles are told."""

TWICE = 2.0
"""Mean error by the nominal machine's from which on a machine is said to be worse."""

FLOOR = np.array([1e-6, 1e-6, 1e-6, 4e-6, 4e-6])
"""A tenth of a count, a third of what one of the gaps tilts: below, none is worse [m, rad]."""


@dataclasses.dataclass(frozen=True)
class Group:
    """One law in one experiment: its flights in the order of machines, first the nominal one's."""

    law: str
    experiment: Experiment
    flown: tuple[Flown, ...]

    @property
    def nominal(self) -> Flown:
        """The machine that is as its parameter files have it."""
        return self.flown[0]

    @functools.cached_property
    def drawn(self) -> tuple[Flown, ...]:
        """All others."""
        return tuple(one for one in self.flown if one.machine != NOMINAL)

    @functools.cached_property
    def survived(self) -> tuple[Flown, ...]:
        """The drawn ones that were not lost."""
        return tuple(one for one in self.drawn if one.verdict != LOST)

    @functools.cached_property
    def score(self) -> FloatArray:
        """Of each of the drawn, its mean error by the nominal's, of the worst axis; lost: inf."""
        usual = np.maximum(self.nominal.mean, FLOOR)
        mean = np.array([one.mean for one in self.drawn]).reshape(-1, 5)
        ratio = np.maximum(mean, FLOOR) / usual
        return np.where(np.isnan(ratio).any(axis=1), np.inf, ratio.max(axis=1))

    @property
    def worse(self) -> NDArray[np.bool_]:
        """Of each of the drawn, whether it flew with more than twice the nominal's mean error."""
        return np.isfinite(self.score) & (self.score > TWICE)

    @property
    def unsettled(self) -> int:
        """How many of the drawn did not settle."""
        return sum(one.verdict == UNSETTLED for one in self.drawn)

    def figures(self, name: str) -> FloatArray:
        """One figure of each that survived, (n,) or (n, 5)."""
        return np.array([getattr(one, name) for one in self.survived])

    def fan(self) -> FloatArray:
        """Quantiles of the largest errors over the measured time, (shares, bins, 5)."""
        kept = np.array([one.envelope for one in self.survived])
        return np.asarray(np.quantile(kept, SHARES, axis=0))


@dataclasses.dataclass(frozen=True)
class Worst:
    """A law's worst machine: where it is that, and by how much, lost: infinity."""

    law: str
    machine: int
    experiment: str
    score: float
    what: str


def groups(campaign: Campaign) -> list[Group]:
    """The flights by law and experiment; those of which the nominal machine was flown."""
    found = []
    for contestant in campaign.plan.contestants:
        for experiment in campaign.plan.experiments(contestant):
            mine = tuple(
                one
                for one in campaign.flown
                if (one.law, one.experiment) == (contestant.name, experiment.name)
            )
            if mine and mine[0].machine == NOMINAL:
                found.append(Group(contestant.name, experiment, mine))
    return found


def worst(found: Sequence[Group], law: str) -> Worst | None:
    """The worst machine of a law, None where none was drawn."""
    mine = [one for one in found if one.law == law and one.drawn]
    if not mine:
        return None
    group = max(mine, key=lambda one: float(one.score.max()))
    flown = group.drawn[int(group.score.argmax())]
    score = float(group.score.max())
    if np.isinf(score):
        what = f'lost: {flown.reason}'
    else:
        ratio = np.maximum(flown.mean, FLOOR) / np.maximum(group.nominal.mean, FLOOR)
        axis = int(ratio.argmax())
        unit = 'µrad' if axis >= 3 else 'µm'
        what = (
            f'mean error of {AXES[axis]} {1e6 * flown.mean[axis]:.2f} {unit},'
            f' {1e6 * group.nominal.mean[axis]:.2f} on the nominal machine'
        )
    return Worst(law, flown.machine, group.experiment.name, score, what)


def drawn_parameters(campaign: Campaign, law: str) -> dict[str, FloatArray]:
    """What was drawn, (machines,) by name, in the order of the drawn machines."""
    (contestant,) = (one for one in campaign.plan.contestants if one.name == law)
    numbers = sorted({one.machine for one in campaign.flown if one.law == law} - {NOMINAL})
    drawn = [campaign.plan.draw(contestant, number).drawn for number in numbers]
    return {name: np.array([one[name] for one in drawn]) for name in (drawn[0] if drawn else ())}


def influence(group: Group, drawn: Mapping[str, FloatArray]) -> list[tuple[str, float]]:
    """Spearman's rank correlation of each drawn parameter with the score, the largest first."""
    if len(set(group.score)) < 2:
        return []
    found = [
        (name, float(spearmanr(values, group.score).statistic))
        for name, values in drawn.items()
        if np.ptp(values) > 0.0
    ]
    return sorted(found, key=lambda one: -abs(one[1]))
