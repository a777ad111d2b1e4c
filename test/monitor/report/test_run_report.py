"""What the page of a run says beside its figures."""

from __future__ import annotations

import dataclasses
import html
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_up_run import TOPICS, Encoder, open_bag, write_samples

from maglev_model.contract.phases import Phase
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.report import run_report, tables
from maglev_monitor.report.terminal import as_text


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


def test_another_flight_in_the_bag_is_said(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    encoder, length = Encoder(), len(run)
    shifted = dataclasses.replace(
        run,
        **{
            column.name: np.concatenate([values := getattr(run, column.name), values])
            for column in dataclasses.fields(run)
        },
    )
    shifted.stamp[length:] += int(np.ptp(run.stamp)) + 1_000_000
    both = {key: [encoder.message(shifted, key, n) for n in range(2 * length)] for key in TOPICS}
    for name, parts, flown in (('one', messages, run), ('two', both, shifted)):
        writer = open_bag(tmp_path / name)
        write_samples(writer, flown, parts)
        writer.close()
    one, two = analyse(tmp_path / 'one'), analyse(tmp_path / 'two')
    assert two.result['axes'] == one.result['axes']
    again = length + int(np.flatnonzero(run.phase == Phase.LIFT_OFF)[0])
    said = f"'two' goes on with another flight, from sample {again} on: not counted"
    assert [note for note in two.notes if 'flight' in note] == [said]
    assert said not in one.notes


def test_the_figures_of_iso_230_2_say_of_how_many_approaches_they_are(bag: Path) -> None:
    analysis = analyse(bag)
    found = dict.fromkeys(tables.REPEATABILITY, 1e-06) | {'targets': 4, 'approaches': 3}
    told = {**analysis.result, 'repeatability': {'own': {'x': found}}}
    page = html.unescape(run_report.render(dataclasses.replace(analysis, result=told)))
    assert '<th>targets</th><th>approaches</th>' in page
    assert '<td>4</td><td>3</td>' in page
    text = as_text(told).splitlines()
    heads = next(line for line in text if 'ISO 230-2' in line)
    assert heads.split()[-2:] == ['targets', 'approaches']
    assert text[text.index(heads) + 1].split()[-2:] == ['4', '3']
