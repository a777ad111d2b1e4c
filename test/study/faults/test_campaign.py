"""The bridge keeps its promises: runs that once broke one, and one of every fifth cell."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from maglev_study.faults.campaign import Campaign, Outcome
from maglev_study.faults.draw import cells, from_json, scenario
from maglev_study.faults.fly import Scenario
from maglev_study.faults.page import describe, describe_violations

_PROCESSES = 2


def listed(name: str) -> Any:
    return json.loads(Path(__file__).with_name(name).read_text(encoding='utf-8'))


FOUND = [from_json(plain) for plain in listed('found.json')]
"""Runs that broke a rule once, as ``failures.json`` of a campaign has them."""

OPEN = {one['seed']: set(one['rules']) for one in listed('open.json')}
"""Seeds whose runs still break rules, and which; what mends one takes it off the list."""


def failures(runs: Sequence[Scenario]) -> dict[int, str]:
    """Fly them, and tell of those that break a rule that is not open, by seed."""
    outcomes: list[Outcome] = []
    with Campaign(_PROCESSES) as campaign:
        campaign.fly(sorted(runs, key=lambda run: run.machine), outcomes.extend)
    assert len(outcomes) == len(runs)
    return {
        one.run.seed: f'{describe(one.run)}: {describe_violations(one)}'
        for one in outcomes
        if {rule for rule, _ in one.verdict.violations} - OPEN.get(one.run.seed, set())
    }


def test_cells_of_fault_and_phase_and_what_was_mended_keep_the_rules() -> None:
    step = 1 if 'MAGLEV_ALL_CELLS' in os.environ else 5  # all take minutes more on two cores
    runs = {run.seed: run for run in [*map(scenario, range(0, len(cells()), step)), *FOUND]}
    runs |= {seed: scenario(seed) for seed in OPEN}
    assert failures(list(runs.values())) == {}
