"""A function over many tasks: in this process, in processes here, or on a Dask cluster."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import resource_tracker
from numbers import Integral
from typing import Any, TypeVar

import joblib

from maglev_model.parameters import ParameterError
from maglev_model.programs.optional import MissingLibraryError, needed
from maglev_study.closed_loop import warm_up

T = TypeVar('T')

PATIENCE = 10.0
"""For a scheduler to answer [s]."""
MOST_JOBS = 512
"""Processes."""


def results(
    function: Callable[..., T],
    tasks: Sequence[tuple[Any, ...]],
    *,
    jobs: int = 1,
    scheduler: str = '',
) -> Iterator[T]:
    """What ``function`` makes of each of the ``tasks``, its arguments, in the order they are done.

    In processes of their own with more than one of ``jobs``; with a ``scheduler`` on that Dask
    cluster, where what a worker had that died is given to another. One thread a process.

    Raises what the function raises, OSError where the scheduler cannot be reached or gives up,
    ParameterError for an address that is none and jobs out of bounds, and
    :class:`~maglev_model.programs.optional.MissingLibraryError` for a scheduler without Dask, and
    for workers without these packages.
    """
    if not isinstance(jobs, Integral) or not 1 <= jobs <= MOST_JOBS:
        raise ParameterError(f"'jobs' is {jobs!r}, it must be a whole number from 1 to {MOST_JOBS}")
    if not tasks:
        return
    if scheduler:
        yield from _on_cluster(function, tasks, scheduler)
        return
    warm_up()  # compiled once, before there are processes
    with joblib.parallel_config('loky', n_jobs=jobs, inner_max_num_threads=1):
        parallel = joblib.Parallel(return_as='generator_unordered', batch_size=1)
        # What starts with Ctrl-C held back leaves it to whoever started it, from its first line;
        # Python's tracker, started meanwhile, would let it through.
        resource_tracker.ensure_running()
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            found = parallel(joblib.delayed(function)(*task) for task in tasks)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
        yield from found


def _on_cluster(
    function: Callable[..., T], tasks: Sequence[tuple[Any, ...]], scheduler: str
) -> Iterator[T]:
    with needed('distributed', '--scheduler'):
        from distributed import Client, KilledWorker, as_completed
        from distributed.client import FutureCancelledError
    try:
        client = Client(scheduler, timeout=PATIENCE)
    except ValueError as error:
        raise ParameterError(f"'{scheduler}' is no address of a scheduler: {error}") from error
    with client:
        futures = client.map(function, *zip(*tasks, strict=True), pure=False)
        try:
            for future in as_completed(futures):
                yield future.result()
        except ModuleNotFoundError as error:
            raise MissingLibraryError(
                f'a worker of {scheduler} lacks {error.name}: install the packages there as here'
            ) from error
        except (FutureCancelledError, KilledWorker) as error:
            raise OSError(f'the cluster at {scheduler} gave up: {error}') from error
