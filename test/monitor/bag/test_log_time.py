"""When a message counts as recorded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from made_up_run import TOPICS, Encoder, Run

from maglev_monitor.bag.log_time import LogTimes


def times(clock: LogTimes, encoder: Encoder, run: Run, key: str) -> list[int]:
    received = [(encoder.message(run, key, n), 5 + n) for n in range(3)]
    kept = clock.of(TOPICS[key][1], received)
    assert [data for data, _ in kept] == [data for data, _ in received]
    return [time for _, time in kept]


def times_of(clock: LogTimes, encoder: Encoder, run: Run, key: str, *part: int) -> list[int]:
    """Of the samples from the first to before the last of ``part``, which come at 5 + n."""
    received = [(encoder.message(run, key, n), 5 + n) for n in range(*part)]
    return [time for _, time in clock.of(TOPICS[key][1], received)]


@pytest.mark.parametrize('key', TOPICS)
def test_samples_in_lockstep_are_recorded_at_their_stage_time(
    key: str, run: Any, encoder: Any
) -> None:
    clock = LogTimes()
    assert times(clock, encoder, run, 'measurement') == run.stage_time[:3].tolist()
    assert times(clock, encoder, run, key) == run.stage_time[:3].tolist()


def test_in_lockstep_other_messages_are_recorded_at_stage_time_too(run: Any, encoder: Any) -> None:
    clock, stage = LogTimes(), run.stage_time

    def others(*received: int) -> list[int]:
        messages = [(b'', time) for time in received]
        return [time for _, time in clock.of('rcl_interfaces/msg/Log', messages)]

    assert others(2) == [2]  # there is no stage time yet
    times(clock, encoder, run, 'measurement')
    assert others(4, 5, 6, 90) == [4, stage[0], stage[1], stage[2]]
    clock.of(TOPICS['measurement'][1], [(encoder.message(run, 'measurement', 3), 100)])
    assert others(99, 100) == [stage[2], stage[3]]  # a burst later


@pytest.mark.parametrize('key', TOPICS)
def test_samples_in_real_time_are_recorded_when_they_come(key: str, run: Any, encoder: Any) -> None:
    encoder, clock = Encoder(lockstep=False), LogTimes()
    assert times(clock, encoder, run, 'measurement') == [5, 6, 7]
    assert times(clock, encoder, run, key) == [5, 6, 7]
    assert clock.of('diagnostic_msgs/msg/DiagnosticArray', [(b'', 7)]) == [(b'', 7)]


@pytest.mark.parametrize('lockstep', [True, False])
def test_samples_that_overtake_the_first_measurement_wait_for_it(run: Any, lockstep: bool) -> None:
    encoder, clock = Encoder(lockstep=lockstep), LogTimes()
    assert times_of(clock, encoder, run, 'reference', 0, 1) == []
    assert times_of(clock, encoder, run, 'reference', 1, 2) == []
    stamped = run.stage_time.tolist() if lockstep else range(5, 10)
    assert times_of(clock, encoder, run, 'measurement', 0, 1) == [stamped[0]]
    assert times_of(clock, encoder, run, 'currents', 0, 1) == [stamped[0]]
    assert times_of(clock, encoder, run, 'reference', 2, 3) == [*stamped[:3]]


def test_what_waits_in_vain_goes_by_when_it_came(run: Any, encoder: Any) -> None:
    clock = LogTimes()
    early = [(encoder.message(run, 'reference', n), n * 400_000_000) for n in range(4)]
    assert clock.of(TOPICS['reference'][1], early[:3]) == []  # 0.8 s
    assert clock.of(TOPICS['reference'][1], []) == []
    assert clock.of(TOPICS['reference'][1], early[3:]) == early
    assert times_of(clock, encoder, run, 'currents', 0, 2) == []
    clock.end()
    assert times_of(clock, encoder, run, 'currents', 2, 3) == [5, 6, 7]


def test_without_a_stamp_that_a_bag_can_tell_it_is_when_they_come(run: Any, encoder: Any) -> None:
    clock = LogTimes()
    times(clock, encoder, run, 'measurement')
    run = Run(**{**vars(run), 'stamp': np.full(len(run), -1_000_000)})
    assert times(clock, encoder, run, 'reference') == [5, 6, 1_000_000]
