"""The bridge keeps its promises: runs that once broke one, and one of each cell."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from maglev_study.faults.campaign import Campaign, Outcome
from maglev_study.faults.draw import cells, from_json, scenario
from maglev_study.faults.page import describe, describe_violations

FOUND = json.loads(Path(__file__).with_name('found.json').read_text(encoding='utf-8'))
"""Runs that broke a rule once, as ``failures.json`` of a campaign has them."""

_PROCESSES = 2


def failures(runs: list) -> list[str]:
    """Fly them, and tell of those that break a rule."""
    outcomes: list[Outcome] = []
    with Campaign(_PROCESSES) as campaign:
        campaign.fly(runs, outcomes.extend)
    assert len(outcomes) == len(runs)
    return [
        f'seed {one.run.seed}: {describe(one.run)}: {describe_violations(one)}'
        for one in outcomes
        if one.verdict.violations
    ]


def test_what_was_mended_stays_mended() -> None:
    assert (
        failures(sorted((from_json(plain) for plain in FOUND), key=lambda run: run.machine)) == []
    )


@pytest.mark.alone
def test_every_cell_of_fault_and_phase_keeps_the_rules() -> None:
    assert failures([scenario(seed) for seed in range(len(cells()))]) == []
