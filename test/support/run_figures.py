"""The figures of the records of a run."""

from __future__ import annotations

from typing import Any

from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.metrics.run_parameters import RunParameters

RUN = RunParameters()


def figures(records: dict[str, Records], run: RunParameters = RUN, burst: int = 10_000) -> Any:
    """The figures of decoded records, fed in bursts."""
    metrics, joiner = RunMetrics(run), Joiner()
    longest = max(len(part) for part in records.values())
    for first in range(0, longest, burst):
        for key, part in records.items():
            joiner.add(key, part[first : first + burst])
        for block in joiner.take():
            metrics.add(block)
    for block in joiner.finish():
        metrics.add(block)
    return metrics.result()
