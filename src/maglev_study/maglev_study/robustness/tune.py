"""The three numbers of each axis that serve the worst of many machines best, within a margin."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from maglev_controller.parameters import ControllerParameters
from maglev_controller.regulator import Regulator
from maglev_model.axes import AXES, FloatArray
from maglev_model.compiled.sources import sources_digest
from maglev_model.parameters import ParameterError, replace
from maglev_model.programs.optional import needed
from maglev_study.comparison.contestants import Contestant
from maglev_study.robustness.draw import NOMINAL
from maglev_study.robustness.fleet import Plan, fly_machine
from maglev_study.robustness.fly import LOST as LOST_FLIGHT
from maglev_study.robustness.fly import Flown
from maglev_study.robustness.guarantee import HOVERING
from maglev_study.robustness.outcome import FLOOR
from maglev_study.workers import results

RANGES: Mapping[str, tuple[float, float]] = {
    'bandwidth': (60.0, 400.0),
    'integration': (10.0, 300.0),
    'learning': (1.0, 60.0),
}
"""Where the numbers are looked for [rad/s]."""

SHARE = 0.05
"""Of the machines, the worst, whose mean counts."""

LOST = 10.0
"""What a lost flight counts, by the nominal error."""

_TRIES = 100  # proposals short of the margin, before it is given up
_SLOWER = 0.97

Numbers = Mapping[str, Mapping[str, float]]
"""The three numbers, by axis and name."""


@dataclasses.dataclass(frozen=True)
class Trial:
    """Numbers that were flown: of each axis (5,) the mean error of the worst machines, by nominal.

    By the error of the default numbers on the nominal machine, mean over the experiments.
    """

    numbers: Numbers
    worst: FloatArray


@dataclasses.dataclass(frozen=True)
class Tuned:
    """What was found: the best numbers of each axis, and how they do on machines not seen before.

    ``fresh`` are the default and the best numbers there, None where Ctrl-C has ended that; ``gain``
    [dB] is what the best are guaranteed at 25 mm.
    """

    numbers: Numbers
    fresh: tuple[Trial, Trial] | None
    gain: float


def numbers_of(controller: ControllerParameters) -> Numbers:
    """Those that a controller has."""
    return {
        axis: {name: getattr(getattr(controller, axis), name) for name in RANGES} for axis in AXES
    }


def with_numbers(contestant: Contestant, numbers: Numbers) -> Contestant:
    """A law with other numbers."""
    named = {f'{axis}.{name}': value for axis in numbers for name, value in numbers[axis].items()}
    return dataclasses.replace(contestant, controller=replace(contestant.controller, named))


def check_tunable(contestant: Contestant) -> None:
    """Raise ParameterError where a law has no such numbers."""
    if contestant.controller.law != 'output_regulator' or any(
        axis.design != 'bandwidth' for axis in contestant.controller.axes
    ):
        raise ParameterError(
            f"law '{contestant.name}' has no bandwidth, integration and learning to tune"
        )


def guaranteed(contestant: Contestant) -> float:
    """The gain [dB] that a law is guaranteed in all currents at 25 mm; 0 where it is refused."""
    try:
        Regulator(contestant.controller)  # which has margins of its own
        return HOVERING.loop(contestant, contestant.plant).guarantees()[0].gain
    except ParameterError:
        return 0.0


class Search:
    """A study of each axis: they share the flights, for an axis hardly feels the others."""

    def __init__(self, contestant: Contestant, margin: float, seed: int) -> None:
        with needed('optuna', 'tune'):
            import optuna
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._contestant, self._margin = contestant, margin
        self._ranges = {
            name: optuna.distributions.FloatDistribution(low, high, log=True)
            for name, (low, high) in RANGES.items()
        }
        self._studies: dict[str, Any] = {}
        self._asked: dict[str, Any] = {}
        for place, (axis, numbers) in enumerate(numbers_of(contestant.controller).items()):
            sampler = optuna.samplers.TPESampler(seed=(seed + place) % 2**32)
            self._studies[axis] = optuna.create_study(sampler=sampler)
            self._studies[axis].enqueue_trial(dict(numbers))

    def ask(self) -> Numbers:
        """Numbers to fly next; those of each axis have the margin where all axes have them.

        Raises ParameterError where none with the margin are found.
        """
        return {axis: self._ask(axis) for axis in AXES}

    def _ask(self, axis: str) -> Mapping[str, float]:
        study = self._studies[axis]
        for _ in range(_TRIES):
            trial = study.ask(self._ranges)
            alike = dict.fromkeys(AXES, trial.params)
            if guaranteed(with_numbers(self._contestant, alike)) >= self._margin:
                self._asked[axis] = trial
                return dict(trial.params)
            study.tell(trial, LOST)
        raise ParameterError(f'no numbers of {axis} are guaranteed ±{self._margin:g} dB')

    def tell(self, trial: Trial) -> None:
        """What came of it."""
        for axis, worst in zip(AXES, trial.worst.tolist(), strict=True):
            self._studies[axis].tell(self._asked[axis], worst)

    def best(self) -> Numbers:
        """The best numbers of each axis so far."""
        return {axis: dict(study.best_params) for axis, study in self._studies.items()}


class Course:
    """Flies numbers on the machines of a plan, and judges them by the worst."""

    def __init__(self, plan: Plan, *, jobs: int = 1, scheduler: str = '') -> None:
        """Flies what errors are compared with: the law as it is on the nominal machine."""
        (self._contestant,) = plan.contestants
        self._plan, self._jobs, self._scheduler = plan, jobs, scheduler
        (nominal,) = self._fly(self._contestant, [NOMINAL])
        self._usual = {one.experiment: np.maximum(one.mean, FLOOR) for one in nominal}

    def trial(self, numbers: Numbers) -> Trial:
        """How numbers do."""
        flying = with_numbers(self._contestant, numbers)
        flown = self._fly(flying, range(1, self._plan.machines + 1))
        each = np.array([self._score(one) for one in flown])
        count = math.ceil(SHARE * len(each))
        return Trial(numbers, np.sort(each, axis=0)[-count:].mean(axis=0))

    def _fly(self, contestant: Contestant, numbers: Sequence[int]) -> list[list[Flown]]:
        part = self._plan.part(contestant)
        tasks = [(part, sources_digest(), number) for number in numbers]
        return list(results(fly_machine, tasks, jobs=self._jobs, scheduler=self._scheduler))

    def _score(self, flown: Sequence[Flown]) -> FloatArray:
        """Of one machine, (5,)."""
        ratios = [
            np.full(5, LOST)
            if one.verdict == LOST_FLIGHT
            else np.minimum(np.maximum(one.mean, FLOOR) / self._usual[one.experiment], LOST)
            for one in flown
        ]
        return np.asarray(np.mean(ratios, axis=0))


def tune(
    plan: Plan,
    trials: int,
    margin: float,
    *,
    jobs: int = 1,
    scheduler: str = '',
    heard: Callable[[int, Trial], None] = lambda *_: None,
) -> Tuned:
    """Look for better numbers of the one law of a plan, on its machines, in so many ``trials``.

    ``margin`` [dB] is what all currents must be guaranteed at once, at 25 mm. What is found is
    judged on as many machines of the next seed. ``heard`` is told of each trial. Ctrl-C ends the
    search with what it has, and the judging without a verdict.

    Raises ParameterError for a law without such numbers and a margin that none have,
    KeyboardInterrupt for Ctrl-C before the first trial is done, and
    :class:`~maglev_model.programs.optional.MissingLibraryError` without Optuna.
    """
    (contestant,) = plan.contestants
    check_tunable(contestant)
    search = Search(contestant, margin, plan.seed)
    course = Course(plan, jobs=jobs, scheduler=scheduler)
    done = 0
    try:
        while done < trials:
            trial = course.trial(search.ask())
            search.tell(trial)
            done += 1
            heard(done, trial)
    except KeyboardInterrupt:
        if not done:
            raise
    numbers, gain = _within(contestant, search.best(), margin)
    try:
        others = dataclasses.replace(plan, seed=plan.seed + 1)
        fresh = Course(others, jobs=jobs, scheduler=scheduler)
        default = fresh.trial(numbers_of(contestant.controller))
        return Tuned(numbers, (default, fresh.trial(numbers)), gain)
    except KeyboardInterrupt:
        return Tuned(numbers, None, gain)


def _within(contestant: Contestant, numbers: Numbers, margin: float) -> tuple[Numbers, float]:
    """Numbers to a tenth, slowed together until the margin is met, and what is guaranteed [dB]."""
    for _ in range(_TRIES):
        told = {
            axis: {name: round(value, 1) for name, value in each.items()}
            for axis, each in numbers.items()
        }
        gain = guaranteed(with_numbers(contestant, told))
        if gain >= margin:
            return told, gain
        numbers = {
            axis: {name: _SLOWER * value for name, value in each.items()}
            for axis, each in numbers.items()
        }
    raise ParameterError(f'no numbers of all axes together are guaranteed ±{margin:g} dB')
