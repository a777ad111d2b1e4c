"""How a stage's samples are taken: a made-up stage, on a node that only notes what it is asked."""

from __future__ import annotations

import time

import numpy as np
import pytest
from made_up_node import MadeUpNode
from made_up_stage import MadeUpStage, currents, start, start_realtime
from rosgraph_msgs.msg import Clock

from maglev_model.contract.stage import StageError
from maglev_model.contract.wire import KEPT
from maglev_msgs.msg import Measurement, PlantState
from maglev_node.sampling import Sampling
from maglev_node.topics import MEASUREMENT, TRUE_STATE


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


def test_in_lockstep_the_sample_that_waits_at_rest_is_repeated_for_another_controller() -> None:
    _, node = start(MadeUpStage())
    node.tick()
    node.controllers = 1
    node.answer(currents(0))
    node.tick()
    assert node.measured == [0, 1]
    node.controllers = 2  # one was killed, which the graph does not know yet
    for _ in range(2):
        node.tick()
    assert node.measured == [0, 1, 1, 1]
    node.answer(currents(1, session=2))
    node.tick()
    assert node.measured == [0, 1, 1, 1, 2]
    node.answer(currents(2, 0.5, session=2))
    node.controllers = 1
    node.tick()
    assert node.measured == [0, 1, 1, 1, 2, 3]  # in flight a controller is waited for


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
def test_a_tick_that_was_due_when_it_was_stopped_finds_nothing_to_do(mode: str) -> None:
    stage = MadeUpStage()
    sampling, node = start(stage, mode=mode)
    node.tick()
    sampling.stop()
    measured = list(node.measured)
    del stage.calls[:]
    node.tick()
    assert stage.calls == []
    assert node.measured == measured


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
