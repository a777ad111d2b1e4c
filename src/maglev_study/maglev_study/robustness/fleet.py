"""A whole campaign: all machines under all laws, over processes here or on a cluster."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import platform
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from maglev_model.compiled.sources import sources_digest
from maglev_model.parameters import ParameterError, values
from maglev_study.comparison.contestants import Contestant, find_contestants
from maglev_study.journal import Journal
from maglev_study.robustness.draw import NOMINAL, Draw, Machine, check_draws, machine, read_draws
from maglev_study.robustness.experiments import Experiment, chosen, experiments
from maglev_study.robustness.fly import Flown, fly
from maglev_study.workers import results

JOURNAL = 'flown.jsonl'
"""The file in a campaign's folder that its results are appended to."""

_LIBRARIES = ('numba', 'numpy', 'scipy')  # on which the last bits depend


@dataclasses.dataclass(frozen=True)
class Plan:
    """Which machines fly under which laws: the nominal one, and those from 1 to ``machines``."""

    machines: int
    seed: int
    draws: tuple[Draw, ...]
    contestants: tuple[Contestant, ...]
    names: tuple[str, ...] = ()  # of the experiments, none: all

    def experiments(self, contestant: Contestant) -> tuple[Experiment, ...]:
        """What a law is flown through."""
        return chosen(contestant.plant.sample_time, contestant.moves, self.names)

    def draw(self, contestant: Contestant, number: int) -> Machine:
        """A machine by its number, about the stage that a law flies on."""
        return machine(self.draws, contestant.plant, self.seed, number)

    def part(self, contestant: Contestant) -> Plan:
        """The same of one law."""
        return dataclasses.replace(self, contestants=(contestant,))

    def head(self) -> dict[str, Any]:
        """What two campaigns must have in common for one to go on with the other."""
        drawn = [(one.by, one.name, dataclasses.astuple(one.of)[:3]) for one in self.draws]
        tables = {
            f'{what} of {one.name}': _digest(values(table))
            for one in self.contestants
            for what, table in (('plant', one.plant), ('controller', one.controller))
        }
        return {
            'code': sources_digest(),
            'libraries': ' '.join(f'{name} {version(name)}' for name in _LIBRARIES),
            'seed': self.seed,
            'laws': [one.name for one in self.contestants],
            'experiments': list(self.names) or 'all',
            'distributions': _digest(drawn),
            **tables,
        }


@dataclasses.dataclass(frozen=True)
class Campaign:
    """What was flown, in the order of machines; ``interrupted`` when not all of the plan was."""

    plan: Plan
    flown: tuple[Flown, ...]
    interrupted: bool


def make_plan(
    params: Path,
    machines: int,
    *,
    laws: Sequence[str] = ('default',),
    names: Sequence[str] = (),
    overlays: Sequence[Path] = (),
    seed: int = 0,
) -> Plan:
    """Read the parameter files; see :func:`campaign`, whose arguments and errors these are."""
    contestants = tuple(find_contestants(params, laws, overlays))
    draws = read_draws(params / 'robustness.yaml', *overlays)
    for one in contestants:
        check_draws(draws, one.plant)
    known = [one.name for one in experiments(contestants[0].plant.sample_time)]
    for name in names:
        if name not in known:
            raise ParameterError(f"there is no experiment '{name}', there are: {', '.join(known)}")
    return Plan(machines, seed, draws, contestants, tuple(names))


def campaign(
    params: Path,
    machines: int,
    out: Path,
    *,
    laws: Sequence[str] = ('default',),
    names: Sequence[str] = (),
    overlays: Sequence[Path] = (),
    seed: int = 0,
    jobs: int = 1,
    scheduler: str = '',
) -> Campaign:
    """Draw machines, fly each under each law, and return what came of them.

    ``params`` is the folder of parameter files, in it ``robustness.yaml`` with the distributions;
    ``overlays`` are files over those of every law; ``names`` the experiments, by default all. With
    more than one of ``jobs`` in processes of their own; with a ``scheduler``, ``tcp://…``, on that
    Dask cluster. Equal arguments give equal results, bit for bit, however many processes. They are
    appended to a file in ``out`` as they come; a campaign that is begun there goes on.

    Raises ParameterError for what is wrong in the files, was flown otherwise in ``out``, or is of
    other code on a worker of the cluster; OSError where ``out`` cannot be written or the scheduler
    not be reached, and :class:`~maglev_model.programs.optional.MissingLibraryError` for a scheduler
    without Dask.
    """
    plan = make_plan(params, machines, laws=laws, names=names, overlays=overlays, seed=seed)
    return fly_plan(plan, out, jobs=jobs, scheduler=scheduler)


def fly_plan(
    plan: Plan,
    out: Path,
    *,
    jobs: int = 1,
    scheduler: str = '',
    heard: Callable[[int, int, Sequence[Flown]], None] = lambda *_: None,
) -> Campaign:
    """:func:`campaign` of a plan.

    ``heard`` is told how much is done, of how much, and what is new, first what was there already.
    Ctrl-C ends it with what was done.
    """
    out.mkdir(parents=True, exist_ok=True)
    head, interrupted = plan.head(), False
    flying = [one for one in plan.contestants if plan.experiments(one)]
    wanted = [(n, one) for n in range(NOMINAL, plan.machines + 1) for one in flying]
    with Journal(out / JOURNAL, head, Flown.to_json, Flown.from_json) as journal:
        done = {(one.machine, one.law) for one in journal.flown}
        missing = [(n, one) for n, one in wanted if (n, one.name) not in done]
        count = len(wanted) - len(missing)
        try:
            heard(count, len(wanted), journal.flown)
            tasks = [(plan.part(one), head['code'], n) for n, one in missing]
            for new in results(fly_machine, tasks, jobs=jobs, scheduler=scheduler):
                journal.add(new)
                count += 1
                heard(count, len(wanted), new)
        except KeyboardInterrupt:
            interrupted = True
    return Campaign(plan, _in_order(plan, journal.flown), interrupted)


def fly_machine(plan: Plan, code: str, number: int) -> list[Flown]:
    """A machine through a plan of one law, on a worker that must have the same code."""
    if code != sources_digest():
        raise ParameterError(
            f"the code of the worker on {platform.node()} is '{sources_digest()}', that of the"
            f" campaign '{code}': install the same on both"
        )
    (contestant,) = plan.contestants
    return fly(plan.draw(contestant, number), contestant, plan.names)


def _in_order(plan: Plan, flown: Sequence[Flown]) -> tuple[Flown, ...]:
    laws = {one.name: place for place, one in enumerate(plan.contestants)}
    names = {one.name: place for place, one in enumerate(experiments(1e-3))}
    chosen = (one for one in flown if one.machine <= plan.machines)
    return tuple(
        sorted(chosen, key=lambda one: (one.machine, laws[one.law], names[one.experiment]))
    )


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:12]
