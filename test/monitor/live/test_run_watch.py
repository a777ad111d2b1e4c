"""A run while it lasts: when it is over, given up, and what it leaves."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import DecodeError
from maglev_model.parameters import build
from maglev_monitor.live.discovery import DiscoveryWatch
from maglev_monitor.live.run_watch import RunWatch, WatchParameters

ALL = {'measurement': 1, 'currents': 1, 'reference': 1}
PARAMETERS = build(WatchParameters, {'start_timeout': 5.0, 'timeout': 2.0, 'fault_grace': 1.0})
SOMEBODY = DiscoveryWatch(0, '/', 0.0)
SOMEBODY.update(['plant'])
Messages = dict[str, list[bytes]]


def part(messages: Messages, first: int, last: int) -> Messages:
    return {key: all_of_it[first:last] for key, all_of_it in messages.items()}


def test_a_run_is_over_when_every_topic_is_past_its_end(run: Any, messages: Messages) -> None:
    end = int(np.flatnonzero(run.phase == Phase.END)[0])
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(part(messages, 0, end))
    assert watch.started
    assert not watch.over(1.0)
    watch.add(part(messages, end, end + 2))
    assert watch.over(1.1)
    result = watch.conclude()
    assert result['verdict'] == 'pass'
    assert watch.conclude(part(messages, 0, 5)) is watch.result is result


@pytest.mark.parametrize(('come', 'grace'), [(0, 0.5), (1000, 4.5)])
def test_a_topic_that_lags_at_the_end_has_a_while_and_more_where_it_came(
    messages: Messages, come: int, grace: float
) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add({**messages, 'plant': messages['plant'][:come]})
    assert not watch.over(1.0)
    assert not watch.over(0.9 + grace)
    assert watch.over(1.1 + grace)
    assert watch.conclude({'plant': messages['plant'][come:]})['missing_samples'] == 0


def test_a_fault_is_watched_for_a_while(run: Any, messages: Messages) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(part(messages, 0, 500))
    assert watch.add_fault(int(run.stamp[400]), 'plant', 'spent', 3.0)
    assert not watch.add_fault(int(run.stamp[410]), 'plant', 'spent again', 3.5)
    assert not watch.over(3.9)
    assert watch.over(4.1)
    assert watch.conclude()['faults'] == ['plant: spent']


def test_a_fault_from_before_a_run_does_not_end_its_watching(run: Any, messages: Messages) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    assert not watch.add_fault(int(run.stamp[10]), 'plant', 'spent', 0.0)
    assert not watch.over(2.0)
    watch.add(part(messages, 0, 500))
    assert not watch.over(4.0)
    watch.add(part(messages, 500, 1200))
    assert watch.over(4.1)
    assert watch.conclude()['verdict'] == 'pass'


def test_a_fault_that_comes_before_the_samples_of_its_run_counts(
    run: Any, messages: Messages
) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    assert not watch.add_fault(int(run.stamp[400]), 'plant', 'spent', 0.0)
    watch.add(part(messages, 0, 500))
    assert not watch.over(3.0)
    assert watch.over(4.1)
    assert watch.conclude()['faults'] == ['plant: spent']


def test_a_run_that_does_not_begin_or_falls_silent_is_given_up(messages: Messages) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    assert watch.given_up(ALL, 4.9) == ''
    assert watch.given_up({**ALL, 'currents': 0}, 5.1) == (
        'no run has begun within 5 s: the controller is not running'
    )
    watch.add(part(messages, 0, 500))
    assert 'STEP' in watch.line(6.0) or 'HOLD' in watch.line(6.0)
    assert watch.given_up(ALL, 7.9) == ''
    assert watch.given_up(ALL, 8.1).startswith('the run has stopped: the ')


def test_a_stage_that_begins_anew_before_the_run_is_waited_for_from_there(
    run: Any, encoder: Any, messages: Messages
) -> None:
    resting = dataclasses.replace(run, phase=np.full_like(run.phase, Phase.REST))
    numbers = range(len(run.phase))
    before = {key: [encoder.message(resting, key, n) for n in numbers] for key in messages}
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(before)
    assert not watch.started
    watch.add(part(before, 0, 30))
    assert watch.given_up(ALL | {'measurement': 2}, 0.9) == ''  # the other may leave again
    assert watch.given_up(ALL, 1.0) == ''
    watch.add(messages)
    assert watch.over(2.0)
    result = watch.conclude()
    assert (result['verdict'], result['missing_samples'], watch.dropped) == ('pass', 0, 0)


def test_a_stage_that_begins_anew_ends_the_run(messages: Messages) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(part(messages, 0, 700))
    assert watch.given_up(ALL, 1.0) == ''
    again = part(messages, 0, 30)
    watch.add(again | {'measurement': messages['measurement'][695:700] + again['measurement']})
    said = watch.given_up(ALL, 2.0)
    assert said == 'the run has stopped: the stage began anew after sample 699'
    assert watch.conclude()['verdict'] == 'incomplete'


def test_what_a_second_stage_measures_while_it_looks_around_is_left_out(
    messages: Messages,
) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(part(messages, 0, 700))
    watch.add({'measurement': messages['measurement'][:20]})
    watch.add(part(messages, 700, 1500))
    assert watch.given_up(ALL, 2.0) == ''
    assert watch.conclude()['verdict'] == 'pass'
    assert watch.dropped == 0


def test_nobody_is_said_not_to_run_whom_nobody_has_seen() -> None:
    watch = RunWatch(PARAMETERS, DiscoveryWatch(7, '/stage1', 0.0), 0.0)
    said = watch.given_up(dict.fromkeys(ALL, 0), 5.1)
    assert 'no run has begun within 5 s: no node of the run is seen on domain 7 in /stage1' in said
    assert 'not running' not in said


def test_a_run_is_waited_for_for_ever_where_that_is_wanted() -> None:
    watch = RunWatch(build(WatchParameters, {'start_timeout': 0.0}), SOMEBODY, 0.0)
    assert watch.given_up(ALL, 1e6) == ''


def test_what_is_no_message_is_refused_but_does_not_spoil_the_end(messages: Messages) -> None:
    watch = RunWatch(PARAMETERS, SOMEBODY, 0.0)
    watch.add(part(messages, 0, 600))
    with pytest.raises(DecodeError):
        watch.add({'currents': [b'nothing']})
    assert watch.conclude({'currents': [b'nothing']})['verdict'] == 'incomplete'
