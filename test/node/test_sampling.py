"""How a stage's samples are taken: a made-up stage, on a node that only notes what it is asked."""

from __future__ import annotations

import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosgraph_msgs.msg import Clock

from maglev_model.stage import EncoderSample, Fault, StageError, Truth
from maglev_msgs.msg import Currents, Measurement, PlantState
from maglev_node.sampling import Sampling
from maglev_node.stage_parameters import ClockedStageParameters
from maglev_node.stamp import nanoseconds
from maglev_node.topics import MEASUREMENT, TRUE_STATE

ZERO = np.zeros(4)


class MadeUpStage:
    """Notes its calls; flies from currents until it has been held ``endurance`` times."""

    sample_time = 1e-3
    late = 0.0

    def __init__(self, *, real: bool = False, truth: bool = False) -> None:
        self.paced = self.restartable = real
        self.fault: Fault | None = None
        self.flying = False
        self.calls: list[str] = []
        self.written: list[float] = []
        self.failing = False
        self.endurance = 3
        self._truth = Truth(np.arange(10.0), ZERO + 1.0, ZERO + 2.0, ZERO + 3.0) if truth else None

    def _call(self, name: str) -> None:
        self.calls.append(name)
        if self.failing:
            raise StageError('it is gone')

    def configure(self) -> None:
        self._call('configure')

    def activate(self) -> None:
        self._call('activate')

    def read(self) -> EncoderSample:
        self._call('read')
        return EncoderSample(np.full(4, 0.031), 0.001, 0.002)

    def write(self, direct_current: Any, quadrature_current: Any) -> None:
        self._call('write')
        if not np.all(np.isfinite(direct_current)):
            raise ValueError('a current is nan')
        self.written.append(float(direct_current[0]))
        self.flying = bool(np.any(direct_current)) and self.fault is None

    def hold(self) -> None:
        self._call('hold')
        self.endurance -= 1
        self.flying = self.flying and self.endurance > 0

    def land(self, why: str) -> None:
        self.calls.append(f'land: {why}')

    def stop(self, why: str = 'emergency stop') -> None:
        if self.fault is None:
            self.fault = Fault('stop', why, 'see to it', True)
        self.flying = False

    def reset(self) -> tuple[bool, str]:
        cleared, self.fault = self.fault is not None or self.failing, None
        self.failing = False
        return cleared, 'cleared'

    def deactivate(self) -> None:
        self._call('deactivate')

    def close(self) -> None:
        self._call('close')

    def truth(self) -> Truth | None:
        return self._truth


class Topic:
    """A publisher; messages are noted by what tells them apart."""

    def __init__(self) -> None:
        self.sequences: list[int] = []
        self.newest: Any = None
        self.stamps: list[int] = []

    def publish(self, message: Any) -> None:
        if isinstance(message, Clock):
            self.stamps.append(nanoseconds(message.clock))
            return
        self.sequences.append(message.sequence)
        self.stamps.append(nanoseconds(message.header.stamp))
        self.newest = message


class Timer:
    """Ticks, or was cancelled."""

    def __init__(self, period: float) -> None:
        self.period, self.timer_period_ns, self.ticking = period, 0, True

    def cancel(self) -> None:
        self.ticking = False

    def reset(self) -> None:
        self.ticking = True


class Inbox:
    """The queue of currents in real time."""

    def __init__(self) -> None:
        self.messages: list[Any] = []

    def take(self) -> Iterator[tuple[Any, int]]:
        waiting, self.messages = self.messages, []
        return ((message, 0) for message in waiting)


class MadeUpNode:
    """What sampling asks of a node."""

    steady_clock = None

    def __init__(self, **parameters: Any) -> None:
        self.parameters = ClockedStageParameters(**parameters)
        self.topics: dict[type, Topic] = {}
        self.errors: list[str] = []
        self.failed: list[str] = []
        self.timers: list[Any] = []
        self.fail = self.failed.append
        self.inbox = Inbox()
        self.subscribers: dict[str, list[str]] = {}

    def get_namespace(self) -> str:
        return '/'

    def get_subscriptions_info_by_topic(self, topic: str) -> list[Any]:
        names = self.subscribers.get(topic, [])
        return [SimpleNamespace(node_name=name, node_namespace='/') for name in names]

    def create_publisher(self, message_type: type, _topic: str, _qos: Any) -> Topic:
        return self.topics.setdefault(message_type, Topic())

    def create_subscription(self, _type: type, _topic: str, callback: Any, _qos: Any) -> Any:
        self.answer = callback
        return SimpleNamespace(topic_name='/stage/currents', get_publisher_count=lambda: 0)

    def poll(self, _topic: str, _type: type) -> Inbox:
        return self.inbox

    def create_timer(self, period: float, action: Any, clock: Any) -> Any:
        self.tick = action
        timer = Timer(period)
        self.timers.append(timer)
        return timer

    def destroy_timer(self, timer: Any) -> None:
        self.timers.remove(timer)

    def get_logger(self) -> Any:
        return SimpleNamespace(error=self.errors.append)

    @property
    def measured(self) -> list[int]:
        return self.topics[Measurement].sequences


def currents(sequence: int, current: float = 0.0) -> Currents:
    return Currents(sequence=sequence, direct_current=[current] * 4)


def start(stage: MadeUpStage, **parameters: Any) -> tuple[Any, MadeUpNode]:
    node: Any = MadeUpNode(**parameters)
    sampling = Sampling(node, stage)
    sampling.start()
    return sampling, node


def start_realtime(stage: MadeUpStage, **parameters: Any) -> tuple[Any, MadeUpNode]:
    return start(stage, mode='realtime', **parameters)


def test_lockstep_repeats_the_first_sample_and_waits_for_each_answer() -> None:
    sampling, node = start(MadeUpStage(), first_sequence=5)
    for _ in range(3):
        node.tick()
    assert node.measured == [5, 5, 5]
    node.answer(currents(4))
    assert node.measured == [5, 5, 5]
    node.answer(currents(5))
    node.tick()  # an answered stage is not repeated
    node.answer(currents(6))
    assert node.measured == [5, 5, 5, 6, 7]
    assert (sampling.sequence, sampling.late_samples) == (7, 0)


def test_the_first_answer_waits_for_those_who_watch() -> None:
    sampling, node = start(MadeUpStage(truth=True), watchers=('monitor', 'recorder'))
    everybody = ['stranger', 'monitor', 'recorder', 'stranger']

    def answered_when(measurement: list[str], true_state: list[str]) -> bool:
        node.subscribers = {MEASUREMENT: measurement, TRUE_STATE: true_state}
        for pause in (0.0, 0.15):  # the middleware gets the time to match them
            time.sleep(pause)
            node.answer(currents(0))
        return node.measured == [0, 1]

    node.tick()
    assert not answered_when(['stranger'] * 9, ['stranger'] * 9)
    assert sampling.awaited() == 'monitor, recorder'
    assert not answered_when(everybody, ['monitor'])
    assert sampling.awaited() == 'recorder'
    assert answered_when(everybody, everybody)


def test_stamps_are_stage_time_from_the_first_sample_on() -> None:
    sampling, node = start(MadeUpStage(), first_sequence=7)
    begin = time.time_ns()
    node.tick()
    time.sleep(0.01)
    for sequence in range(7, 32):
        node.answer(currents(sequence))
    sent = node.topics[Measurement]
    assert begin <= sent.stamps[0] <= time.time_ns() - 10_000_000
    assert np.diff(sent.stamps).tolist() == [1_000_000] * 25
    assert sent.newest.lockstep
    assert sent.newest.wall_time >= begin + 10_000_000
    assert node.topics[Clock].stamps == sent.stamps[::10]
    sampling.stop()
    sampling.start()
    node.tick()
    assert sent.stamps[-1] - sent.stamps[-2] != 1_000_000  # begins anew


def test_in_real_time_the_stage_is_no_clock() -> None:
    _, node = start_realtime(MadeUpStage(real=True))
    node.tick()
    assert not node.topics[Measurement].newest.lockstep
    assert Clock not in node.topics


def test_the_truth_goes_out_beside_the_measurement() -> None:
    _, node = start(MadeUpStage(truth=True), first_sequence=3)
    node.tick()
    state = node.topics[PlantState].newest
    assert (state.sequence, list(state.state)) == (3, list(range(10)))
    assert state.header.stamp == node.topics[Measurement].newest.header.stamp
    assert [list(state.direct_current), list(state.thermal_load)] == [[1.0] * 4, [3.0] * 4]
    assert PlantState not in start(MadeUpStage())[1].topics


def test_currents_are_followed_from_zero_on_also_after_a_reset() -> None:
    stage = MadeUpStage()
    sampling, node = start(stage)
    for sequence, current in enumerate((0.5, 0.5, 0.0, 0.7)):
        node.answer(currents(sequence, current))
    assert stage.written == [0.0, 0.7]
    assert 'emergency stop' in sampling.emergency_stop()
    assert sampling.reset()[0]
    for sequence, current in enumerate((0.9, 0.0, 0.8), start=4):
        node.answer(currents(sequence, current))
    assert stage.written == [0.0, 0.7, 0.0, 0.8]


def test_currents_that_a_stage_refuses_are_a_fault_said_once() -> None:
    stage = MadeUpStage()
    _, node = start(stage)
    for sequence, current in enumerate((0.0, 0.5, float('nan'), float('nan'))):
        node.answer(currents(sequence, current))
    assert stage.fault is not None
    assert stage.fault.reason == 'a current is nan'
    assert len(node.errors) == 1
    assert node.errors[0].startswith('fault at sample 2: a current is nan (currents cut)')


@pytest.mark.parametrize('real', [False, True])
def test_unanswered_it_goes_on_until_it_has_landed(
    real: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = MadeUpStage(real=real)
    sampling, node = start(stage, answer_timeout=5.0)
    node.answer(currents(0))
    node.answer(currents(1, 0.5))
    monkeypatch.setattr(sampling, '_sample_time', time.monotonic() - 6.0)
    node.tick()
    assert stage.calls[-7:] == ['hold', 'read', 'hold', 'read', 'hold', 'read', 'hold']
    said = node.errors if real else node.failed
    assert said == [
        'no currents for sample 2 within 6.0 s: no controller publishes /stage/currents any more'
    ]
    assert [len(node.errors), len(node.failed)] == ([1, 0] if real else [0, 1])
    assert sampling.answered is not real


@pytest.mark.parametrize('call', ['read', 'hold', 'write'])
def test_a_stage_that_is_lost_ends_its_node(call: str) -> None:
    stage = MadeUpStage()
    _, node = start(stage)
    node.answer(currents(0))
    stage.failing = True
    node.answer(currents(1))
    assert node.failed == ['it is gone']
    del stage.calls[:]
    node.answer(currents(1))
    node.tick()
    assert stage.calls == []  # nothing more is asked of it


def test_a_restartable_one_waits_for_a_reset() -> None:
    stage = MadeUpStage(real=True)
    sampling, node = start(stage)
    node.answer(currents(0))
    stage.failing = True
    node.answer(currents(1))
    node.tick()
    assert node.measured == [1]
    assert sampling.reset() == (True, 'cleared')
    assert node.measured == [1, 2]
    node.tick()  # waits for a controller again
    assert node.measured == [1, 2, 2]
    assert node.failed == []


def test_real_time_takes_the_newest_currents_and_counts_missing_ones() -> None:
    stage = MadeUpStage(real=True)
    sampling, node = start_realtime(stage)
    answers = ([0], [1, 2], [], [], [3, 4, 5], [6])  # to the samples that tick after tick follow
    for newest in answers:
        node.inbox.messages = [currents(number, 0.1 * number) for number in newest]
        node.tick()
    assert node.measured == [1, 2, 3, 4, 5, 6]
    assert stage.written == pytest.approx([0.0, 0.2, 0.5, 0.6])
    assert stage.calls[2:] == [
        *('read', 'write', 'read', 'write', 'read', 'hold', 'read', 'hold'),
        *('read', 'write', 'read', 'write'),
    ]
    assert sampling.late_samples == 1  # at sample 4, with the currents for sample 2
    assert node.timers[0].timer_period_ns > 0


def test_real_time_without_a_controller_nothing_is_late() -> None:
    sampling, node = start_realtime(MadeUpStage(real=True))
    for _ in range(50):
        node.tick()
    node.inbox.messages = [currents(3)]  # it catches up with what it missed at its start
    node.tick()
    assert (sampling.answered, sampling.late_samples) == (False, 0)
    node.inbox.messages = [currents(50)]
    node.tick()
    assert sampling.answered


def test_a_stage_without_a_clock_gives_up_when_it_is_too_late(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stage = MadeUpStage()
    sampling, node = start_realtime(stage, overrun_limit=0.5)
    begun = time.monotonic()
    monkeypatch.setattr(sampling._pace, '_clock', lambda: begun + 0.3)
    for _ in range(4):
        node.tick()
    assert node.measured == list(range(1, 9))  # two at a time
    monkeypatch.setattr(sampling._pace, '_clock', lambda: begun + 0.6)
    del stage.calls[:]
    node.tick()
    assert len(node.failed) == 1
    assert 'behind the clock at sample 8' in node.failed[0]
    assert stage.calls == []


def test_stopped_it_lands_first_and_takes_no_more_samples() -> None:
    stage = MadeUpStage()
    sampling, node = start(stage)
    node.answer(currents(0))
    node.answer(currents(1, 0.5))
    sampling.stop()
    landing = ['hold', 'read', 'hold', 'read', 'hold', 'read', 'hold']
    assert stage.calls[-9:] == ['land: deactivated', *landing, 'deactivate']
    assert node.timers == []
    assert node.measured == [1, 2, 3, 4, 5]
    node.answer(currents(5))
    assert node.measured == [1, 2, 3, 4, 5]
    sampling.start()
    node.tick()
    assert node.measured[-1] == 6


@pytest.mark.parametrize('mode', ['lockstep', 'realtime'])
def test_while_the_stage_is_lost_nothing_ticks(mode: str) -> None:
    stage = MadeUpStage(real=True)
    node = MadeUpNode(mode=mode)
    sampling = Sampling(node, stage)  # type: ignore[arg-type,var-annotated]
    sampling.start()
    timer = node.timers[0]
    stage.failing = True
    if mode == 'realtime':
        node.tick()
    else:
        sampling.land('for a test')
        sampling._advance()
    assert not timer.ticking
    assert sampling.reset()[0]
    assert timer.ticking
