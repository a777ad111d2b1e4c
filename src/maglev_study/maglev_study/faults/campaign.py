"""Many runs over several processes, with progress, until they are done or it is interrupted."""

from __future__ import annotations

import ctypes
import multiprocessing
import signal
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import groupby
from multiprocessing.synchronize import Event
from typing import Any, NamedTuple, TypeVar

from maglev_model.programs.command import noted
from maglev_study.faults.draw import scenario
from maglev_study.faults.fly import Scenario
from maglev_study.faults.judge import Verdict
from maglev_study.faults.machines import PLAIN, Believed
from maglev_study.faults.shrink import shrink
from maglev_study.faults.train import fly_all, warm_up

_LOOK = 0.2  # from a look at the signals to the next [s]
_PR_SET_PDEATHSIG = 1  # of prctl(2)

_stop: Event | None = None

T = TypeVar('T')


class Outcome(NamedTuple):
    """A run and its verdict."""

    run: Scenario
    verdict: Verdict

    def to_json(self) -> dict[str, Any]:
        """The run's seed and the verdict, as plain values."""
        return {'seed': self.run.seed, **self.verdict._asdict()}

    @classmethod
    def from_json(cls, plain: Mapping[str, Any], *, double: bool) -> Outcome:
        """What :meth:`to_json` wrote, of runs with ``double`` faults or not."""
        verdict = {name: plain[name] for name in Verdict._fields}
        verdict['violations'] = tuple((rule, text) for rule, text in plain['violations'])
        return cls(scenario(plain['seed'], double=double), Verdict(**verdict))


class Campaign:
    """Processes that fly runs; to be used in a ``with`` statement.

    Ctrl-C ends what is under way after the run that it is at; what was done so far is kept.
    """

    def __init__(self, jobs: int, believed: Believed = PLAIN) -> None:
        self._jobs, self._believed = jobs, believed
        self.interrupted = False

    def __enter__(self) -> Campaign:
        context = multiprocessing.get_context('fork')
        self._stop = context.Event()
        warm_up(self._believed)
        self._pool = ProcessPoolExecutor(self._jobs, context, _begin, (self._stop,))
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)

    def fly(self, runs: Sequence[Scenario], heard: Callable[[list[Outcome]], None]) -> None:
        """Fly runs, handing over outcomes as they come.

        Raises ParameterError when a machine does not fly even without a fault.
        """
        by_machine = [list(group) for _, group in groupby(runs, key=lambda run: run.machine)]
        flown = [self._pool.submit(_fly, part, self._believed) for part in by_machine]
        self._do(flown, heard)

    def shrink(
        self, failures: Sequence[Outcome], heard: Callable[[tuple[Outcome, Outcome]], None]
    ) -> None:
        """Make failures as small as they still fail, handing over each with what it became."""
        tried = [self._pool.submit(_shrink, failure, self._believed) for failure in failures]
        self._do(tried, heard)

    def _do(self, futures: list[Future[T]], heard: Callable[[T], None]) -> None:
        if self.interrupted:
            return
        waiting = set(futures)
        with noted(signal.SIGINT) as caught:
            while waiting and not caught:
                done, waiting = wait(waiting, _LOOK, FIRST_COMPLETED)
                for future in done:
                    heard(future.result())
            self.interrupted = bool(caught)
            if self.interrupted:
                self._stop.set()
                self._pool.shutdown(cancel_futures=True)
            for future in waiting:
                if not future.cancelled():
                    heard(future.result())


def _begin(stop: Event) -> None:
    """A worker leaves Ctrl-C to whoever started it, and does not outlive it."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _stopped() -> bool:
    return _stop is not None and _stop.is_set()


def _fly(runs: Sequence[Scenario], believed: Believed) -> list[Outcome]:
    return [Outcome(run, verdict) for run, verdict in fly_all(runs, believed, _stopped)]


def _shrink(failure: Outcome, believed: Believed) -> tuple[Outcome, Outcome]:
    return failure, Outcome(*shrink(failure.run, failure.verdict, believed, _stopped))
