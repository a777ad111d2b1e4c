"""Samples that a run lacks: which are missed, how they are told, and which are none of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from run_figures import RUN, figures

from maglev_model.contract.phases import Phase
from maglev_monitor.metrics.decoding import Records
from maglev_monitor.metrics.joiner import Joiner
from maglev_monitor.metrics.run_metrics import RunMetrics
from maglev_monitor.report.terminal import as_text


def test_bursts_and_block_edges_change_no_bit(records: dict[str, Records]) -> None:
    once = figures(records)
    for burst in (7, 50, 333, 500):
        assert figures(records, burst=burst) == once


def ranges(numbers: set[int]) -> list[list[int]]:
    """First and last of each run of consecutive numbers."""
    firsts = sorted(number for number in numbers if number - 1 not in numbers)
    lasts = sorted(number for number in numbers if number + 1 not in numbers)
    return [list(pair) for pair in zip(firsts, lasts, strict=True)]


def test_holes_are_named_where_they_fail_a_run(records: dict[str, Records]) -> None:
    lost = {'plant': [*range(300, 400), 777], 'currents': range(200, 1000, 3)}
    for key, numbers in lost.items():
        records[key] = np.delete(records[key], list(numbers))
    found = figures(records, burst=50)
    assert found['reasons'] == [
        'number of missing samples is 368, allowed is 0:'
        ' currents in 267 holes: 200, 203, 206, 209 and 263 more;'
        ' plant in 2 holes: 300–399, 777'
    ]
    assert len(found['holes']['currents']['samples']) == 20
    assert found['reasons'][0].partition(': ')[2] in as_text(found)


def test_a_gap_of_whole_blocks_is_one_hole(records: dict[str, Records]) -> None:
    cut = {key: np.delete(part, range(250, 900)) for key, part in records.items()}
    found, joiner = RunMetrics(RUN), Joiner(block=50)
    for key, part in cut.items():
        joiner.add(key, part)
    for block in joiner.finish():
        found.add(block)
    hole = {'count': 1, 'samples': [[250, 899]]}
    assert found.result()['holes'] == dict.fromkeys(
        ('reference', 'measurement', 'currents', 'controller', 'plant'), hole
    )


@settings(max_examples=25)
@given(
    lost=st.dictionaries(
        st.sampled_from(['reference', 'measurement', 'currents', 'controller', 'plant']),
        st.sets(st.integers(70, 1120), min_size=1, max_size=30),
    )
)
def test_lost_samples_are_counted_by_topic(lost: dict[str, set[int]], decoded: Any) -> None:
    kept = {
        key: part[~np.isin(part['sequence'], list(lost.get(key, set())))]
        for key, part in decoded.items()
    }
    found = figures(kept)
    expected = {key: len(lost.get(key, set())) for key in kept}
    assert found['missing_by_topic'] == expected
    assert found['missing_samples'] == sum(expected.values())
    assert set(found['holes']) == {key for key, count in expected.items() if count}
    for key, holes in found['holes'].items():
        wanted = ranges(lost[key])
        assert holes == {'count': len(wanted), 'samples': wanted[:20]}
    assert (found['verdict'] == 'pass') == (not any(expected.values()))


def test_a_loss_of_whole_blocks_is_counted(records: dict[str, Records]) -> None:
    kept = {
        key: part[(part['sequence'] < 100) | (part['sequence'] >= 1050)]
        for key, part in records.items()
    }
    metrics, joiner = RunMetrics(RUN), Joiner(block=50)
    for key, part in kept.items():
        joiner.add(key, part)
    for block in joiner.finish():
        metrics.add(block)
    found = metrics.result()
    assert found['missing_by_topic'] == dict.fromkeys(kept, 950)
    assert found['run_samples'] == 1200 - 60 - 60


def test_a_run_without_end_is_incomplete(run: Any, records: dict[str, Records]) -> None:
    found = figures({key: part[:1000] for key, part in records.items()})
    assert found['verdict'] == 'incomplete'
    assert 'the run did not reach its end' in found['reasons']


@pytest.mark.parametrize('phase', [Phase.LIFT_OFF, Phase.HOLD, Phase.TRACK])
def test_a_run_that_is_known_from_its_middle_on_is_incomplete(
    phase: Phase, records: dict[str, Records]
) -> None:
    first = int(np.flatnonzero(records['reference']['phase'] == phase)[0])
    found = figures({key: part[first:] for key, part in records.items()})
    lacks = [] if phase == Phase.LIFT_OFF else ['what is known of the run begins in flight']
    assert found['reasons'] == lacks
    assert found['verdict'] == ('incomplete' if lacks else 'pass')


@pytest.mark.parametrize('lost', [(), (600,), (600, 799)])
def test_a_landing_after_the_reference_was_ended_is_no_loss(
    lost: tuple[int, ...], records: dict[str, Records]
) -> None:
    kept = {key: part[:1000] for key, part in records.items()}
    reference = kept['reference'][:801]
    kept['reference'] = reference[~np.isin(reference['sequence'], lost)]
    found = figures(kept, burst=50)
    assert found['missing_by_topic'] == dict.fromkeys(kept, 0) | {'reference': len(lost)}
    holes = {'count': len(lost), 'samples': [[number, number] for number in lost]}
    assert found['holes'] == ({'reference': holes} if lost else {})
    assert found['reasons'][-1] == 'the run did not reach its end'


def test_what_comes_after_the_end_changes_nothing(records: dict[str, Records]) -> None:
    end = int(np.flatnonzero(records['reference']['phase'] == Phase.END)[0])
    shorter = {key: part[: end + 1] for key, part in records.items()}
    assert figures(shorter) == figures(records)
