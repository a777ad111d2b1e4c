"""From a bag to the figures and curves of its run. No ROS here."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.contract.phases import Phase
from maglev_model.parameters import DIFFERS, ParameterError
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.reader import Bag, run_folder
from maglev_monitor.metrics.curves import RunCurves
from maglev_monitor.metrics.decoding import Records, stage_period
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import (
    FAULT_LEVEL,
    RUN_KEY,
    RunParameters,
    run_from_json,
)

UNTOLD = (
    'no monitor speaks in the bag, on diagnostics: machine and limits of the run are not known, the'
    ' default machine stands in, and of limits missing samples alone are checked'
)
"""The note on a bag without parameters of its run, which may be whole all the same."""

_NO_NEWS = ('effective_parameters:', 'command:')
"""Parameters that are said elsewhere, or say nothing of a run."""


@dataclasses.dataclass(frozen=True)
class Analysis:
    """What a bag says of its run: its figures, its curves, and notes on the bag itself."""

    result: dict[str, Any]
    curves: RunCurves
    run: RunParameters
    tick_histogram: NDArray[np.int64]
    notes: list[str]
    changes: list[tuple[str, str]]
    """Node, and a parameter of it that was not as by default, with both values."""
    custom: dict[str, str]
    """What the bag says of itself besides, by name: ``software``, ``command``."""


def analyse(path: Path, progress: Progress | None = None) -> Analysis:
    """Read a bag and compute its figures; how far it is read, ``progress`` is told.

    Raises :class:`~.errors.BagError` when there is no bag, or nothing of a run in it.
    """
    bag = Bag(path, progress)
    run, notes = run_parameters(bag)
    try:
        metrics = RunMetrics(run)
    except ParameterError as error:
        notes.append(f'further metrics are left out: {error}')
        run = dataclasses.replace(run, metrics=dataclasses.replace(run.metrics, modules=()))
        metrics = RunMetrics(run)
    curves, joiner = RunCurves(run), Joiner()
    again: int | None = None
    for block in _blocks(bag, joiner, metrics):
        curves.add(metrics.add(block))
        if again is None and metrics.ended:
            again = _lift_off(block, joiner.end or 0)
    if again is not None:
        notes.append(
            f"'{bag.path.name}' goes on with another flight, from sample {again} on: not counted"
        )
    if not metrics.started:
        raise BagError(f"the bag '{bag.path}' holds no run: the reference never left REST")
    result = metrics.result(cut_off=bool(bag.notes))
    changes = _changes(run_folder(path) / 'params')
    return Analysis(
        result, curves, run, metrics.tick_histogram, bag.notes + notes, changes, bag.custom()
    )


def _blocks(bag: Bag, joiner: Joiner, metrics: RunMetrics) -> Iterator[Records]:
    """Joined samples, block by block; errors that nodes report go to ``metrics``."""
    for batch in bag.batches():
        for key, records in batch.samples.items():
            joiner.add(key, records)
        for status in batch.diagnostics:
            if status.level >= FAULT_LEVEL:
                metrics.add_fault(status.stamp, status.name, status.message)
        yield from joiner.take()
    yield from joiner.finish()


def _lift_off(block: Records, after: int) -> int | None:
    """The first sample of a lift-off after a run's end."""
    lifts = block['has_reference'] & (block['phase'] == Phase.LIFT_OFF)
    samples = block['sequence'][lifts & (block['sequence'] > after)]
    return int(samples[0]) if len(samples) else None


def _changes(folder: Path) -> list[tuple[str, str]]:
    """What the nodes of a run wrote of their parameters, nothing where they wrote none."""
    changes = []
    for file in sorted(folder.glob('*.yaml')):
        for line in file.read_text(encoding='utf-8', errors='replace').splitlines():
            change = line.removeprefix(DIFFERS)
            if change != line and not change.startswith(_NO_NEWS):
                changes.append((file.stem, change))
    return changes


def run_parameters(bag: Bag) -> tuple[RunParameters, list[str]]:
    """The parameters the monitor left in the bag; without a monitor the defaults.

    The sample time then is the stage's. A note says so, and where they cannot be read.
    """
    notes = [UNTOLD]
    period: float | None = None
    for batch in bag.batches():
        if period is None and 'measurement' in batch.samples:
            period = stage_period(batch.samples['measurement'])
        for status in batch.diagnostics:
            if RUN_KEY in status.values:
                try:
                    return run_from_json(status.values[RUN_KEY]), []
                except ParameterError as error:
                    notes = [
                        f'limits and parameters of the run are lost, defaults stand in: {error}'
                    ]
    run = RunParameters()
    return dataclasses.replace(run, sample_time=period or run.sample_time), notes
