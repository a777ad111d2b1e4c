"""Topics come together by sample number, in any order, with losses, in bounded memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import KEPT, TOPIC_TYPES
from maglev_monitor.metrics.decoding import Records, decode
from maglev_monitor.metrics.joiner import Joiner

KEYS = tuple(TOPIC_TYPES)


def records_for(key: str, sequence: Any) -> Records:
    """Records of one topic with given sample numbers, all else zero but what shows the number."""
    numbers = np.asarray(sequence, np.int64)
    records = np.zeros(len(numbers), decode(key, []).dtype)
    records['sequence'] = numbers
    records['nanoseconds'] = numbers
    if key == 'reference':
        records['segment'] = numbers
    if key == 'measurement':
        records['x'] = numbers
    return records


def joined(joiner: Joiner) -> list[Records]:
    return [*joiner.take(), *joiner.finish()]


def present(blocks: list[Records], key: str) -> NDArray[np.int64]:
    """Sample numbers a topic has in blocks."""
    if not blocks:
        return np.zeros(0, np.int64)
    rows = np.concatenate(blocks)
    sequence: NDArray[np.int64] = rows['sequence'][rows[f'has_{key}']]
    return sequence


def test_rows_hold_all_topics(run: Any, messages: dict[str, list[bytes]]) -> None:
    joiner = Joiner(block=100)
    for key in KEYS:
        joiner.add(key, decode(key, messages[key]))
    blocks = list(joiner.take())
    rows = np.concatenate(blocks)
    assert len(rows) == len(run)
    assert all(rows[f'has_{key}'].all() for key in KEYS)
    np.testing.assert_array_equal(rows['stamp'], run.stamp)
    np.testing.assert_array_equal(rows['stage_time'], run.stage_time)
    np.testing.assert_array_equal(rows['limited_by'], run.limited_by)
    np.testing.assert_array_equal(rows['reference'], run.reference)
    np.testing.assert_array_equal(rows['gap'], run.gap)
    np.testing.assert_array_equal(rows['direct_current'], run.direct)
    np.testing.assert_array_equal(rows['state'][:, 0:10:2], run.position)


@settings(max_examples=40)
@given(data=st.data())
def test_order_and_bursts_do_not_matter(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 40))
    total = data.draw(st.integers(1, 200))
    lost = {key: data.draw(st.sets(st.integers(0, total - 1), max_size=10)) for key in KEYS}
    bursts = []
    for key in KEYS:
        kept = [n for n in range(total) if n not in lost[key]]
        edge = data.draw(st.integers(0, len(kept)))
        bursts += [(key, kept[:edge]), (key, kept[edge:])]
    joiner = Joiner(block=size, window=10_000)
    for index in data.draw(st.permutations(range(len(bursts)))):
        joiner.add(bursts[index][0], records_for(*bursts[index]))
    blocks = joined(joiner)
    ends = [max(set(range(total)) - lost[key], default=-1) for key in KEYS[1:]]
    last = min((end for end in ends if end > max(ends) - 100 and end >= 0), default=-1)
    for key in KEYS:
        expected = [n for n in range(total) if n not in lost[key] and n <= last]
        np.testing.assert_array_equal(present(blocks, key), expected)
    assert all(block['sequence'][0] % size == 0 for block in blocks)
    assert all(len(block) == size for block in blocks[:-1])
    assert not blocks or blocks[-1]['sequence'][-1] == last or len(blocks[-1]) == size
    assert joiner.dropped == 0


def test_a_block_waits_for_the_slowest_topic() -> None:
    joiner = Joiner(block=10, window=100)
    for key in KEYS[1:]:
        joiner.add(key, records_for(key, range(50)))
    assert list(joiner.take()) == []
    joiner.add(KEYS[0], records_for(KEYS[0], range(25)))
    assert [block['sequence'][0] for block in joiner.take()] == [0, 10]


def test_a_topic_that_never_comes_does_not_hold_the_rest_back() -> None:
    joiner = Joiner(block=10, window=30)
    blocks: list[Records] = []
    for first in range(0, 200, 5):
        for key in ('reference', 'measurement', 'currents', 'controller'):
            joiner.add(key, records_for(key, range(first, first + 5)))
        blocks += joiner.take()
        assert len(joiner._pending) <= 5
    np.testing.assert_array_equal(present(blocks, 'measurement'), np.arange(170))
    assert len(present(blocks, 'plant')) == 0


@pytest.mark.parametrize('behind', [4500, KEPT['lockstep'] - 1])
def test_what_a_publisher_still_keeps_is_waited_for(behind: int) -> None:
    joiner = Joiner()
    for key in KEYS:
        joiner.add(key, records_for(key, range(203)))
    for key in ('reference', 'measurement', 'currents', 'controller'):
        joiner.add(key, records_for(key, range(203, 203 + behind)))
    blocks = list(joiner.take())
    joiner.add('plant', records_for('plant', range(203, 203 + behind)))
    blocks += joined(joiner)
    assert joiner.dropped == 0
    np.testing.assert_array_equal(present(blocks, 'plant'), np.arange(203 + behind))


def test_what_comes_too_late_is_counted_and_what_comes_twice_counts_once() -> None:
    joiner = Joiner(block=10, window=0)
    joiner.add('measurement', records_for('measurement', range(25)))
    first = list(joiner.take())
    joiner.add('currents', records_for('currents', [3, 4, 22]))
    joiner.add('measurement', records_for('measurement', [24, 25]))
    assert joiner.dropped == 2
    blocks = [*first, *joined(joiner)]
    np.testing.assert_array_equal(present(blocks, 'currents'), [22])
    np.testing.assert_array_equal(present(blocks, 'measurement'), np.arange(23))


def test_a_reference_far_ahead_does_not_push_blocks_out() -> None:
    joiner = Joiner(block=10, window=20)
    joiner.add('reference', records_for('reference', range(1000)))
    joiner.add('measurement', records_for('measurement', range(15)))
    assert list(joiner.take()) == []


def test_a_gap_of_whole_blocks_makes_no_blocks() -> None:
    joiner = Joiner(block=10, window=0)
    for key in KEYS:
        joiner.add(key, records_for(key, [3, 10**12]))
    blocks = joined(joiner)
    assert [block['sequence'][0] for block in blocks] == [0, 10**12]


def test_a_topic_that_stopped_does_not_cut_the_rest() -> None:
    joiner = Joiner(block=50, window=10_000)
    joiner.add('reference', records_for('reference', range(560)))
    joiner.add('measurement', records_for('measurement', range(503)))
    joiner.add('plant', records_for('plant', range(500)))
    joiner.add('currents', records_for('currents', range(200)))
    blocks = list(joiner.finish())
    np.testing.assert_array_equal(np.concatenate(blocks)['sequence'], np.arange(500))
    np.testing.assert_array_equal(present(blocks, 'currents'), np.arange(200))


def test_the_end_is_kept_even_where_a_topic_lags() -> None:
    joiner = Joiner(block=50, window=10_000)
    reference = records_for('reference', range(200))
    reference['phase'][150:] = Phase.END
    joiner.add('reference', reference)
    joiner.add('measurement', records_for('measurement', range(151)))
    joiner.add('currents', records_for('currents', range(149)))
    assert joiner.end == 150
    assert np.concatenate(list(joiner.finish()))['sequence'][-1] == 150
