"""Whose currents a stage follows, and which it does not."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from made_up_stage import MadeUpStage, currents, start, start_realtime

from maglev_msgs.msg import Currents
from maglev_node.stamp import set_stamp


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
