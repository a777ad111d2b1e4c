"""From a bag to the figures and series of its run. No ROS here."""

from __future__ import annotations

import dataclasses
import json
import os
from pathlib import Path
from typing import Any

from maglev_model.parameters import ParameterError
from maglev_monitor.bag.reader import Bag
from maglev_monitor.bag.writer import BagError
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.settings import RunParameters, run_from_json
from maglev_monitor.report.curves import RunSeries

RUN_KEY = 'run'
"""Key of the value in the monitor's diagnostics that carries the parameters of the run."""

ERROR = 2
"""Diagnostic level from which on a node's message counts as a fault (REP-107)."""


@dataclasses.dataclass(frozen=True)
class Analysis:
    """What a bag says of its run: its figures, its series, and notes on the bag itself."""

    result: dict[str, Any]
    series: RunSeries
    run: RunParameters
    tick_histogram: Any
    notes: list[str]


def analyse(path: Path) -> Analysis:
    """Read a bag and compute its figures.

    Raises :class:`maglev_monitor.bag.writer.BagError` when there is no bag, or nothing of a run in
    it.
    """
    bag = Bag(path)
    run = _run_parameters(bag)
    metrics, series, joiner = RunMetrics(run.metrics), RunSeries(run.metrics), Joiner()
    for batch in bag.batches():
        for key, records in batch.samples.items():
            joiner.add(key, records)
        for status in batch.diagnostics:
            if status.level >= ERROR:
                metrics.add_fault(status.stamp, status.name, status.message)
        for block in joiner.take():
            series.add(metrics.add(block))
    for block in joiner.finish():
        series.add(metrics.add(block))
    notes = list(bag.notes)
    if not metrics.started:
        raise BagError(f"the bag '{bag.path}' holds no run: the reference never left REST")
    return Analysis(metrics.result(run), series, run, metrics.tick_histogram, notes)


def write_metrics(path: Path, result: dict[str, Any]) -> None:
    """Write ``metrics.json`` in one go: the file is either whole or not there. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + '.tmp')
    temporary.write_text(json.dumps(result, indent=2) + '\n', encoding='utf-8')
    os.replace(temporary, path)


def _run_parameters(bag: Bag) -> RunParameters:
    """The parameters the monitor left in the bag; the defaults when there was no monitor."""
    for batch in bag.batches():
        for status in batch.diagnostics:
            if RUN_KEY in status.values:
                try:
                    return run_from_json(status.values[RUN_KEY])
                except ParameterError:
                    continue
    return RunParameters()
