"""A whole campaign: all machines under all laws, over processes here or on a cluster."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import json
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import joblib

from maglev_model.optional import needed
from maglev_model.parameters import values
from maglev_study.closed_loop import warm_up
from maglev_study.comparison.contestants import Contestant, find_contestants
from maglev_study.robustness.draw import NOMINAL, Draw, Machine, check_draws, machine, read_draws
from maglev_study.robustness.experiments import experiments
from maglev_study.robustness.fly import Flown, fly
from maglev_study.robustness.journal import Journal

JOURNAL = 'flown.jsonl'
"""The file in a campaign's folder that its results are appended to."""


@dataclasses.dataclass(frozen=True)
class Plan:
    """Which machines fly under which laws: the nominal one, and those from 1 to ``machines``."""

    machines: int
    seed: int
    draws: tuple[Draw, ...]
    contestants: tuple[Contestant, ...]

    def draw(self, contestant: Contestant, number: int) -> Machine:
        """A machine by its number, about the stage that a law flies on."""
        return machine(self.draws, contestant.plant, self.seed, number)

    def head(self) -> dict[str, Any]:
        """What two campaigns must have in common for one to go on with the other."""
        drawn = [(one.by, one.name, dataclasses.astuple(one.of)[:3]) for one in self.draws]
        tables = {
            f'{what} of {one.name}': _digest(values(table))
            for one in self.contestants
            for what, table in (('plant', one.plant), ('controller', one.controller))
        }
        return {
            'seed': self.seed,
            'laws': [one.name for one in self.contestants],
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
    overlays: Sequence[Path] = (),
    seed: int = 0,
) -> Plan:
    """Read the parameter files; see :func:`campaign`, whose arguments and errors these are."""
    contestants = tuple(find_contestants(params, laws, overlays))
    draws = read_draws(params / 'robustness.yaml', *overlays)
    for one in contestants:
        check_draws(draws, one.plant)
    return Plan(machines, seed, draws, contestants)


def campaign(
    params: Path,
    machines: int,
    out: Path,
    *,
    laws: Sequence[str] = ('default',),
    overlays: Sequence[Path] = (),
    seed: int = 0,
    jobs: int = 1,
    scheduler: str = '',
) -> Campaign:
    """Draw machines, fly each under each law, and return what came of them.

    ``params`` is the folder of parameter files, in it ``robustness.yaml`` with the distributions;
    ``overlays`` are files over those of every law. With more than one of ``jobs`` in processes of
    their own; with a ``scheduler``, ``tcp://…``, on that Dask cluster. Equal arguments give equal
    results, bit for bit, however many processes. They are appended to a file in ``out`` as they
    come; a campaign that is begun there goes on.

    Raises ParameterError for what is wrong in the files or was flown otherwise in ``out``,
    OSError where that cannot be written or the scheduler not be reached, and
    :class:`~maglev_model.optional.MissingLibraryError` for a scheduler without Dask.
    """
    plan = make_plan(params, machines, laws=laws, overlays=overlays, seed=seed)
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
    wanted = [(n, one) for n in range(NOMINAL, plan.machines + 1) for one in plan.contestants]
    interrupted = False
    with Journal(out / JOURNAL, plan.head()) as journal:
        done = journal.done
        missing = [(n, one) for n, one in wanted if (n, one.name) not in done]
        count = len(wanted) - len(missing)
        try:
            heard(count, len(wanted), journal.flown)
            if missing:
                warm_up()  # compiled once, before there are processes
            with _processes(jobs, scheduler) as parallel:
                work = (joblib.delayed(_work)(plan.draws, one, plan.seed, n) for n, one in missing)
                for new in parallel(work):
                    journal.add(new)
                    count += 1
                    heard(count, len(wanted), new)
        except KeyboardInterrupt:
            interrupted = True
    return Campaign(plan, _in_order(plan, journal.flown), interrupted)


def _work(draws: Sequence[Draw], contestant: Contestant, seed: int, number: int) -> list[Flown]:
    if threading.current_thread() is threading.main_thread() and _is_worker():
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever started it
    return fly(machine(draws, contestant.plant, seed, number), contestant)


def _is_worker() -> bool:
    import multiprocessing

    return multiprocessing.parent_process() is not None


@contextlib.contextmanager
def _processes(jobs: int, scheduler: str) -> Iterator[joblib.Parallel]:
    """What work is given to, a generator of results as they come; one thread a process."""
    options = {'return_as': 'generator_unordered', 'batch_size': 1}
    if scheduler:
        with needed('distributed', '--scheduler'):
            from distributed import Client
        with Client(scheduler, timeout=10.0), joblib.parallel_config('dask'):
            yield joblib.Parallel(**options)
    else:
        with joblib.parallel_config('loky', n_jobs=jobs, inner_max_num_threads=1):
            yield joblib.Parallel(**options)


def _in_order(plan: Plan, flown: Sequence[Flown]) -> tuple[Flown, ...]:
    laws = {one.name: place for place, one in enumerate(plan.contestants)}
    names = {one.name: place for place, one in enumerate(experiments(1e-3))}
    chosen = (one for one in flown if one.machine <= plan.machines)
    return tuple(
        sorted(chosen, key=lambda one: (one.machine, laws[one.law], names[one.experiment]))
    )


def _digest(content: object) -> str:
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()[:12]
