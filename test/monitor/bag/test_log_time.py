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


def test_without_a_measurement_or_a_stamp_it_is_when_they_come(run: Any, encoder: Any) -> None:
    clock = LogTimes()
    assert times(clock, encoder, run, 'reference') == [5, 6, 7]
    times(clock, encoder, run, 'measurement')
    run = Run(**{**vars(run), 'stamp': np.full(len(run), -1_000_000)})
    assert times(clock, encoder, run, 'reference') == [-1_000_000, 6, 1_000_000]
