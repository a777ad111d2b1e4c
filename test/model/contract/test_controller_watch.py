"""Whose currents a stage follows, whatever comes in whatever order."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.contract.controller_watch import NOBODY, ControllerWatch, Status, Verdict

ZERO = np.zeros(4)
ONE = np.ones(4)


class Message(NamedTuple):
    """What reaches a stage, beside time passing."""

    session: int = 1
    age: int = 0  # samples since what it answers; negative: still to come
    status: int = Status.FLYING
    current: float = 1.0
    stamped: bool = True


class Flight:
    """A stage that flies with what it follows, and lands by itself from what is refused."""

    def __init__(self) -> None:
        self.watch = ControllerWatch()
        self.sample = 10
        self.flying = False
        self.followed: list[tuple[int, int]] = []  # session and sequence number, this flight
        self.ended = ''

    def hear(self, message: Message) -> Verdict:
        """Judge a message and act accordingly."""
        verdict = self.watch.judge(
            message.session,
            self.sample - message.age,
            message.status,
            message.current * ONE,
            ZERO,
            stamped=message.stamped,
            sample=self.sample,
            flying=self.flying,
        )
        if verdict is Verdict.FOLLOWED:
            self.flying = message.current != 0.0
            self.followed.append((message.session, self.sample - message.age))
        elif verdict is Verdict.REFUSED:
            self.ended = self.watch.why
        return verdict

    def land(self) -> None:
        """Come to rest."""
        self.flying, self.ended = False, ''


REST = Message(status=Status.RESTING, current=0.0)
messages = st.builds(
    Message,
    session=st.sampled_from([NOBODY, 1, 2]),
    age=st.integers(-2, 4),
    status=st.sampled_from([*Status, 7]),
    current=st.sampled_from([0.0, 1.0, np.nan]),
    stamped=st.booleans(),
)


@given(st.lists(st.one_of(messages, st.just('sample'), st.just('at rest')), max_size=60))
def test_in_flight_one_controller_in_order_or_none(events: list[Message | str]) -> None:
    flight = Flight()
    for event in events:
        if event == 'at rest':
            flight.land()
        elif event == 'sample':
            flight.sample += 1
        elif isinstance(event, Message):
            before, flown = flight.flying, flight.watch.session
            verdict = flight.hear(event)
            if verdict is Verdict.FOLLOWED:
                assert flight.watch.session == event.session != NOBODY
                assert event.stamped
                assert event.age >= 0
                rests = event.status == Status.RESTING and event.current == 0.0
                assert rests or event.status == Status.FLYING
                assert rests or event.session == flown  # taken up from zero currents only
                assert not before or event.session == flown
                own = [number for session, number in flight.followed if session == event.session]
                assert own[-1] == max(own)
            elif verdict is Verdict.ELSEWHERE:
                assert before
                assert flight.watch.session == flown != event.session != NOBODY
                assert event._replace(age=0) == REST._replace(session=event.session, stamped=False)
            elif before:
                assert not flight.watch.taken_up  # whatever comes, it lands
                assert flight.ended
            if before and flown == NOBODY:
                assert verdict is Verdict.IGNORED
    assert not flight.ended or flight.flying


@given(st.lists(messages, max_size=8))
def test_a_controller_that_works_is_always_taken_up(strange: list[Message]) -> None:
    flight = Flight()
    for message in strange:
        flight.hear(message)
    flight.land()
    flight.sample += 10
    assert flight.hear(REST) is Verdict.FOLLOWED
    for _ in range(100):
        flight.sample += 1
        assert flight.hear(Message()) is Verdict.FOLLOWED
    assert flight.flying


def test_taken_up_at_rest_with_a_prompt_answer() -> None:
    flight = Flight()
    for age, verdict in ((3, Verdict.IGNORED), (2, Verdict.FOLLOWED)):
        assert flight.hear(REST._replace(age=age)) is verdict
    flight.sample += 5
    for message, why in (
        (REST._replace(session=2, age=3), '3 samples late'),
        (REST._replace(session=NOBODY), 'without a session'),
        (Message(session=2), 'until the controller has commanded none'),
        (REST._replace(session=2, stamped=False), 'stamp'),
        (REST._replace(age=-1), 'still to come'),
        (Message(status=Status.RESTING), 'says it rests'),
    ):
        assert flight.hear(message) is Verdict.IGNORED
        assert why in flight.watch.why
    assert flight.watch.session == 1


def test_who_rests_at_another_stage_does_not_end_a_flight() -> None:
    flight = Flight()
    flight.hear(REST)
    flight.sample += 1
    flight.hear(Message())
    stranger = REST._replace(session=2, age=9, stamped=False)
    assert flight.hear(stranger) is Verdict.ELSEWHERE
    assert 'another stage' in flight.watch.why
    flight.sample += 1
    assert flight.hear(Message()) is Verdict.FOLLOWED
    for change in ({'stamped': True}, {'current': 1.0}, {'status': Status.FLYING}, {'session': 0}):
        again = Flight()
        again.hear(REST)
        again.sample += 1
        again.hear(Message())
        again.sample += 1
        assert again.hear(stranger._replace(**change)) is Verdict.REFUSED


def test_who_gives_up_at_rest_has_to_be_taken_up_again() -> None:
    flight = Flight()
    flight.hear(REST)
    flight.sample += 1
    assert flight.hear(Message(session=2, status=Status.GAVE_UP)) is Verdict.IGNORED
    assert (flight.watch.taken_up, flight.watch.gave_up) == (True, False)
    assert flight.hear(Message(status=Status.GAVE_UP, age=1)) is Verdict.IGNORED
    assert (flight.watch.taken_up, flight.watch.gave_up) == (False, True)
    assert flight.hear(Message()) is Verdict.IGNORED


def test_before_any_command_nobody_is_followed_blamed_or_has_given_up() -> None:
    watch = ControllerWatch()
    assert (watch.taken_up, watch.why, watch.gave_up) == (False, '', False)


def test_the_very_first_sample_may_be_answered_and_a_stage_may_begin_anew() -> None:
    flight = Flight()
    for beginning in (0, 5, 0):
        flight.sample = beginning
        assert flight.hear(REST) is Verdict.FOLLOWED
        flight.watch.forget()


def test_each_status_has_a_number_that_stays() -> None:
    """It is what goes over the wire."""
    assert [(status.name, status.value) for status in Status] == [
        ('RESTING', 0),
        ('FLYING', 1),
        ('GAVE_UP', 2),
    ]


def flying() -> Flight:
    """Follows controller 1, whose newest command answers the newest sample."""
    flight = Flight()
    for message in (REST, Message(), Message()):
        flight.sample += 1
        assert flight.hear(message) is Verdict.FOLLOWED
    assert flight.flying
    return flight


@pytest.mark.parametrize(
    ('message', 'why'),
    [
        (Message(session=2), 'from somebody else'),
        (Message(session=NOBODY), 'from somebody else'),
        (Message(status=Status.GAVE_UP), 'the controller gave up'),
        (Message(status=7), 'with status 7'),
        (Message(age=-1), 'still to come'),
        (Message(age=1), 'after those for sample'),
        (Message(age=2), 'after those for sample'),
        (Message(stamped=False), 'the stamp of another measurement'),
        (Message(status=Status.RESTING), 'says it rests'),
    ],
)
def test_in_flight_what_is_not_followed_is_refused_and_nobody_is_taken_up(
    message: Message, why: str
) -> None:
    flight = flying()
    flight.sample += 1 if message.age <= 0 else 0
    assert flight.hear(message) is Verdict.REFUSED
    assert why in flight.watch.why
    assert flight.watch.gave_up == (message.status == Status.GAVE_UP)
    assert not flight.watch.taken_up
    flight.sample += 1
    for again in (Message(), REST, message):
        assert flight.hear(again) is Verdict.IGNORED  # until it has come to rest
    flight.land()
    flight.sample += 1
    assert flight.hear(REST) is Verdict.FOLLOWED


def test_in_flight_its_controller_is_followed_from_sample_to_sample() -> None:
    flight = flying()
    for _ in range(3):
        flight.sample += 2
        assert flight.hear(Message(age=1)) is Verdict.FOLLOWED
        assert flight.hear(Message(age=0)) is Verdict.FOLLOWED
        assert flight.watch.newest == flight.sample


def test_in_flight_one_sample_is_answered_once() -> None:
    flight = flying()
    assert flight.hear(Message()) is Verdict.REFUSED
    assert 'after those for sample' in flight.watch.why
