"""A run that fails, made smaller as long as it breaks the same rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

from maglev_study.faults.catalogue import KINDS
from maglev_study.faults.fly import Scenario
from maglev_study.faults.judge import Verdict
from maglev_study.faults.kinds import Fault
from maglev_study.faults.machines import NOMINAL, PLAIN, Believed
from maglev_study.faults.train import fly_all

_SIMPLE = (('rest', 0.5), ('hover', 0.98), ('lift-off', 0.5), ('ellipse', 0.5))
"""Phases to try, the simplest first."""

_MOST = 8  # tries


def shrink(
    run: Scenario,
    verdict: Verdict,
    believed: Believed = PLAIN,
    stopped: Callable[[], bool] = lambda: False,
) -> tuple[Scenario, Verdict]:
    """The smallest run found that breaks the rule that this one broke first, and its verdict."""
    rule = verdict.violations[0][0]
    tries, found = 0, True
    while found:
        found = False
        for smaller in _smaller(run):
            if tries >= _MOST or stopped():
                return run, verdict
            tries += 1
            ((_, outcome),) = fly_all([smaller], believed)
            if any(broken == rule for broken, _ in outcome.violations):
                run, verdict, found = smaller, outcome, True
                break
    return run, verdict


def _smaller(run: Scenario) -> Iterator[Scenario]:
    """What is one step smaller, the greatest steps first."""
    if len(run.faults) > 1:
        for fault in run.faults:
            yield run._replace(faults=(dataclasses.replace(fault, delay=0),))
    if run.machine != NOMINAL:
        yield run._replace(machine=NOMINAL)
    for phase, instant in _SIMPLE:
        if phase == run.phase:
            break
        if all(phase in KINDS[fault.kind].phases for fault in run.faults):
            yield run._replace(phase=phase, instant=instant)
    for number, fault in enumerate(run.faults):
        for less in _less(fault):
            faults = (*run.faults[:number], less, *run.faults[number + 1 :])
            yield run._replace(faults=faults)


def _less(fault: Fault) -> Iterator[Fault]:
    if len(fault.targets) > 2:
        for target in fault.targets:
            rest = tuple(other for other in fault.targets if other != target)
            yield dataclasses.replace(fault, targets=rest)
    if abs(fault.size) >= 2.0:
        yield dataclasses.replace(fault, size=float(int(fault.size / 2.0)))
    if fault.delay > 1:
        yield dataclasses.replace(fault, delay=fault.delay // 2)
