"""How a stage's samples are taken: a made-up stage, on a node that only notes what it is asked."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from made_up_node import MadeUpNode
from rosgraph_msgs.msg import Clock

from maglev_model.stage import EncoderSample, Fault, StageError, Truth
from maglev_msgs.msg import Currents, Measurement, PlantState
from maglev_node.sampling import Sampling
from maglev_node.stamp import set_stamp
from maglev_node.topics import KEPT, MEASUREMENT, TRUE_STATE

ZERO = np.zeros(4)


_TRUTH = Truth(np.arange(10.0), ZERO + 1.0, ZERO + 2.0, ZERO + 3.0, np.full(6, 4.0))


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
        self.ages: list[int] = []
        self.failing = False
        self.endurance = 3
        self._truth = _TRUTH if truth else None

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

    def write(self, direct_current: Any, quadrature_current: Any, age: int = 0) -> None:
        self._call('write')
        if not np.all(np.isfinite(direct_current)):
            raise ValueError('a current is nan')
        self.written.append(float(direct_current[0]))
        self.ages.append(age)
        self.flying = bool(np.any(direct_current)) and self.fault is None

    def hold(self) -> None:
        self._call('hold')
        self.endurance -= 1
        self.flying = self.flying and self.endurance > 0

    def land(self, why: str) -> None:
        self.calls.append(f'land: {why}')

    def stop(self, why: str = 'emergency stop', kind: str = 'stop', remedy: str = '') -> None:
        if self.fault is None:
            self.fault = Fault(kind, why, remedy, not self.restartable)
        self.flying = self.flying and self.restartable  # as the bridge, which lands

    def reset(self) -> tuple[bool, str]:
        cleared, self.fault = self.fault is not None or self.failing, None
        self.failing = False
        return cleared, 'cleared'

    def deactivate(self) -> None:
        self.calls.append('deactivate')

    def close(self) -> None:
        self._call('close')

    def truth(self) -> Truth | None:
        return self._truth


def currents(sequence: int, current: float = 0.0, session: int = 1) -> Currents:
    """What a controller sends for a sample, but for the stamp."""
    status = Currents.FLYING if current else Currents.RESTING
    return Currents(sequence=sequence, direct_current=[current] * 4, session=session, status=status)


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


def test_a_stage_without_a_first_sample_is_not_left_active() -> None:
    stage = MadeUpStage()
    fine = stage.activate

    def activate() -> None:
        fine()
        stage.failing = True

    stage.activate = activate  # type: ignore[method-assign]
    with pytest.raises(StageError, match='it is gone'):
        start(stage)
    assert stage.calls == ['activate', 'read', 'deactivate']


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
    for sequence in range(7, 82):
        node.answer(currents(sequence))
    sent = node.topics[Measurement]
    assert begin <= sent.stamps[0] <= time.time_ns() - 10_000_000
    assert np.diff(sent.stamps).tolist() == [1_000_000] * 75
    assert sent.newest.lockstep
    assert sent.newest.wall_time >= begin + 10_000_000
    assert node.topics[Clock].stamps == sent.stamps[::10]
    sampling.stop()
    sampling.start()
    node.tick()
    assert sent.stamps[-1] > sent.stamps[-2]  # though it was ahead of the wall clock
    sampling.stop()
    time.sleep(0.1)
    begin = time.time_ns()
    sampling.start()
    node.tick()
    assert begin <= sent.stamps[-1] <= time.time_ns()  # begins anew


def test_in_real_time_the_stage_is_no_clock() -> None:
    _, node = start_realtime(MadeUpStage(real=True))
    node.tick()
    assert not node.topics[Measurement].newest.lockstep
    assert Clock not in node.topics


@pytest.mark.parametrize('mode', KEPT)
def test_what_is_kept_for_readers_is_bounded_by_the_mode(mode: str) -> None:
    _, node = start(MadeUpStage(truth=True), mode=mode)
    assert node.depths == {KEPT[mode]}


def test_the_truth_goes_out_beside_the_measurement() -> None:
    _, node = start(MadeUpStage(truth=True), first_sequence=3)
    node.tick()
    state = node.topics[PlantState].newest
    assert (state.sequence, list(state.state)) == (3, list(range(10)))
    assert state.header.stamp == node.topics[Measurement].newest.header.stamp
    assert [list(state.direct_current), list(state.thermal_load)] == [[1.0] * 4, [3.0] * 4]
    assert list(state.own_length) == [4.0] * 6
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


@pytest.mark.parametrize('cause', ['a sample', 'a command'])
def test_a_fault_is_said_after_the_output_that_answers_it(
    cause: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage, before = MadeUpStage(real=True), []
    _, node = start_realtime(stage)

    class Log(list[str]):
        def append(self, text: str) -> None:
            before.append(stage.calls[-1])
            super().append(text)

    node.errors = Log()
    node.tick()
    for sequence, current in enumerate((0.0, 0.5, 0.5), start=1):
        node.inbox.messages = [currents(sequence, current)]
        node.tick()
    assert stage.flying
    if cause == 'a sample':
        sound = stage.read
        monkeypatch.setattr(stage, 'read', lambda: (stage.stop('it jumped'), sound())[1])
    else:
        node.inbox.messages = [currents(4, 0.5, session=2)]
    node.tick()
    assert len(node.errors) == 1
    assert before == ['hold']


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
    answers = ([], [1], [2], [], [], [3, 4, 5], [6])  # to the samples that tick after tick follow
    for newest in answers:
        node.inbox.messages = [currents(number, 0.1 * (number - 1)) for number in newest]
        node.tick()
    assert node.measured == [1, 2, 3, 4, 5, 6, 7]
    assert stage.written == pytest.approx([0.0, 0.1, 0.4, 0.5])
    assert stage.ages == [1, 1, 1, 1]
    assert stage.calls[2:] == [
        *('read', 'hold', 'read', 'write', 'read', 'write', 'read', 'hold', 'read', 'hold'),
        *('read', 'write', 'read', 'write'),
    ]
    assert sampling.late_samples == 2  # at samples 4 and 5, with the currents for sample 2
    assert node.timers[0].timer_period_ns > 0


def test_the_age_of_currents_is_told_to_the_stage() -> None:
    stage = MadeUpStage(real=True)
    _, node = start_realtime(stage)
    for answer in (0, 1, 2, 0, 3, 0, 4):
        node.inbox.messages = [currents(answer, 0.1 * (answer - 1))] if answer else []
        node.tick()
    assert stage.ages == [1, 1, 2, 3]  # by their numbers, however regularly they come


IN_FLIGHT: dict[str, tuple[Callable[[int], list[Currents]], str]] = {
    'given up': (
        lambda n: [Currents(sequence=n - 1, session=1, status=Currents.GAVE_UP)],
        'the controller gave up',
    ),
    'somebody else': (lambda n: [currents(n, 0.5, session=2)], 'somebody else'),
    'somebody else, who rests': (lambda n: [currents(n, session=2)], 'somebody else'),
    'nobody': (lambda n: [currents(n, 0.5, session=0)], 'somebody else'),
    'both': (lambda n: [currents(n, 0.5, session=2), currents(n, 0.5)], 'somebody else'),
    'repeated': (lambda n: [currents(n - 1, 0.5)], 'after those for sample'),
    'older': (lambda n: [currents(n - 2, 0.5)], 'after those for sample'),
    'still to come': (lambda n: [currents(n + 2, 0.5)], 'still to come'),
    'of another run': (
        lambda n: [stamped_otherwise(currents(n, 0.5))],
        'with the stamp of another measurement',
    ),
    'at rest, with currents': (
        lambda n: [Currents(sequence=n, session=1, direct_current=[0.5] * 4)],
        'says it rests',
    ),
    'in a state of its own': (
        lambda n: [Currents(sequence=n, session=1, status=7, direct_current=[0.5] * 4)],
        'with status 7',
    ),
}


def stamped_otherwise(message: Currents) -> Currents:
    set_stamp(message.header.stamp, 1_000_000_001)
    return message


@pytest.mark.parametrize('case', IN_FLIGHT)
@pytest.mark.parametrize('mode', ['lockstep', 'realtime'])
def test_what_no_controller_would_say_ends_a_flight(mode: str, case: str) -> None:
    stage = MadeUpStage(real=True)
    sampling, node = start(stage, mode=mode)

    def say(messages: list[Currents]) -> None:
        if mode == 'lockstep':
            for message in messages:
                node.answer(message)
        else:
            node.inbox.messages = messages
            node.tick()

    node.tick()
    for current in (0.0, 0.5, 0.5):
        say([currents(sampling.sequence, current)])
    assert (stage.flying, sampling.late_samples, stage.fault) == (True, 0, None)
    make, said = IN_FLIGHT[case]
    say(make(sampling.sequence))
    assert stage.fault is not None
    assert stage.fault.kind == 'controller'
    assert said in stage.fault.reason
    assert stage.written == [0.0, 0.5, 0.5]
    for _ in range(5):  # what flies on is not followed
        say([currents(sampling.sequence, 0.5)])
    assert stage.written == [0.0, 0.5, 0.5]
    assert not stage.flying
    assert len(node.errors) == 1
    assert sampling.reset()[0]
    say([currents(sampling.sequence, 0.5)])
    say([currents(sampling.sequence, 0.0, session=2)])
    say([currents(sampling.sequence, 0.7, session=2)])
    assert stage.written == [0.0, 0.5, 0.5, 0.0, 0.7]


def test_at_rest_another_controller_is_taken_up_and_its_end_is_no_fault() -> None:
    stage = MadeUpStage(real=True)
    sampling, node = start(stage)
    node.answer(currents(0))
    node.answer(Currents(sequence=0, session=1, status=Currents.GAVE_UP))
    node.answer(currents(1, 0.4))
    assert not sampling.controller.taken_up
    node.answer(currents(2, session=2))
    node.answer(currents(3, session=3))
    node.answer(currents(4, 0.3, session=3))
    assert stage.written == [0.0, 0.0, 0.0, 0.3]
    assert stage.fault is None


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
