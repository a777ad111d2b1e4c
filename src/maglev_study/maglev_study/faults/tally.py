"""Outcomes counted: by cell of fault and phase, by vendor's call, by rule."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from maglev_study.faults.campaign import Outcome
from maglev_study.faults.catalogue import KINDS
from maglev_study.faults.programme import PHASES


class Cell(NamedTuple):
    """What came of the runs of one cell."""

    runs: int
    impact: float  # greatest [m/s]
    detection: float | None  # greatest [s]
    median: float | None  # of the times of detection [s]
    cut: int  # runs in which the current was cut in flight
    violations: int  # runs that broke a rule


def count(outcomes: Iterable[Outcome]) -> Cell:
    """One cell of these."""
    verdicts = [outcome.verdict for outcome in outcomes]
    times = [verdict.detection for verdict in verdicts if verdict.detection is not None]
    return Cell(
        runs=len(verdicts),
        impact=max((verdict.impact for verdict in verdicts), default=0.0),
        detection=max(times, default=None),
        median=float(np.median(times)) if times else None,
        cut=sum(verdict.ended == 'cut' for verdict in verdicts),
        violations=sum(bool(verdict.violations) for verdict in verdicts),
    )


class Tally:
    """All outcomes of a campaign, sorted."""

    def __init__(self, outcomes: Sequence[Outcome]) -> None:
        self.outcomes = outcomes
        self.failures = [outcome for outcome in outcomes if outcome.verdict.violations]
        self._cells: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
        self._calls: dict[tuple[str, str], list[Outcome]] = defaultdict(list)
        for outcome in outcomes:
            fault = outcome.run.faults[0]
            self._cells[fault.kind, outcome.run.phase].append(outcome)
            if fault.call:
                self._calls[fault.kind, fault.call].append(outcome)

    @property
    def kinds(self) -> list[str]:
        """The rows that have runs, in the order of the catalogue."""
        return [name for name in KINDS if any((name, phase) in self._cells for phase in PHASES)]

    def cell(self, kind: str, phase: str) -> Cell | None:
        """What came of a cell; None when it was not flown."""
        found = self._cells.get((kind, phase))
        return count(found) if found else None

    def row(self, kind: str) -> Cell:
        """What came of a kind of fault over all phases."""
        return count(one for phase in PHASES for one in self._cells.get((kind, phase), ()))

    def call(self, kind: str, call: str) -> Cell | None:
        """What came of a vendor's call that failed in a way."""
        found = self._calls.get((kind, call))
        return count(found) if found else None

    def rarest(self) -> tuple[int, str]:
        """How often the rarest cell was flown, and which it is."""
        times = {
            (name, phase): len(self._cells.get((name, phase), ()))
            for name, kind in KINDS.items()
            for phase in kind.phases
        }
        kind, phase = min(times, key=lambda cell: times[cell])
        return times[kind, phase], f'{kind} in {phase}'

    def by_rule(self) -> dict[int, int]:
        """Runs that broke each rule."""
        broken = Counter(
            rule
            for outcome in self.failures
            for rule in {rule for rule, _ in outcome.verdict.violations}
        )
        return dict(sorted(broken.items()))

    def examples(self) -> list[Outcome]:
        """One failure, the mildest, of each kind of fault and first rule broken."""
        found: dict[tuple[str, int], Outcome] = {}
        for outcome in self.failures:
            found.setdefault(
                (outcome.run.faults[0].kind, outcome.verdict.violations[0][0]), outcome
            )
        return list(found.values())
