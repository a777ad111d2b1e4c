"""What the page of a run says beside its figures."""

from __future__ import annotations

import dataclasses
import html
from pathlib import Path
from typing import Any

import pytest

from maglev_monitor.bag.analysis import analyse
from maglev_monitor.report import run_report


@pytest.mark.parametrize(
    ('changes', 'whose'),
    [
        ({}, "encoders' own scales"),
        ({'own_axes': None}, 'true position'),
        (
            {'own_axes': None, 'error_source': 'measured'},
            'as counted, errors with half a count more',
        ),
    ],
)
def test_it_says_whose_errors_are_checked_and_shows_further_metrics(
    changes: dict[str, Any], whose: str, bag: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_report, 'charts', lambda _: [])
    analysis = analyse(bag)
    further = {'further': {'my_stage.effort': {'direct_effort': 0.3261, 'unknown': None}}}
    told = {**analysis.result, **further, 'limits': {'max_overshoot': 5.0}, **changes}
    page = html.unescape(run_report.render(dataclasses.replace(analysis, result=told)))
    assert f'Errors and steps that are checked: {whose}.' in page
    assert '<td>my_stage.effort</td><td>direct_effort</td><td>0.3261</td>' in page
    assert '<td>unknown</td><td>–</td>' in page
