"""The judge finds a bridge that is broken on purpose, rule by rule, and lets a sound one pass."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from maglev_controller.supervision import Supervisor
from maglev_hw_bridge import faults
from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.board import Board
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.landing import Landing
from maglev_hw_bridge.sensing.guard import Guard
from maglev_hw_bridge.stage import BridgeStage
from maglev_study.faults.flight import Flight
from maglev_study.faults.fly import expected_of
from maglev_study.faults.judge import Judge, Verdict
from maglev_study.faults.kinds import Fault

Flown = Callable[..., Verdict]
KILLED = Fault('controller: killed')
ALOFT = ('lift-off', 0.95)  # at 25 mm


def broken(verdict: Verdict) -> set[int]:
    return {rule for rule, _ in verdict.violations}


def test_a_sound_bridge_lands_softly_in_time_and_starts_again(flown: Flown) -> None:
    verdict = flown(KILLED, 'hover', 0.5)
    assert verdict.violations == ()
    assert verdict.ended == 'landed'
    assert 0.0 < verdict.impact < 0.01
    assert verdict.detection == pytest.approx(0.005, abs=0.0021)
    assert 'currents' in verdict.reason


def test_no_fault_at_all_is_none(flown: Flown) -> None:
    verdict = flown(Fault('none'), 'ellipse', 0.4)
    assert verdict == verdict._replace(violations=(), detection=None, reason='', ended='landed')


def test_1_what_is_not_found_out(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Guard.watch

    def blind(self: Guard, *arguments: Any) -> Any:
        return (0, *sound(self, *arguments)[1:])

    monkeypatch.setattr(Guard, 'watch', blind)
    assert 1 in broken(flown(Fault('stuck: x or z', (4,)), 'ellipse', 0.5))


HIDDEN = Fault('stuck: x or z', (4,)), 'hover', 0.97  # while it stands still


def test_1_what_is_hidden_is_due_when_forces_tell(flown: Flown) -> None:
    verdict = flown(*HIDDEN)
    assert verdict.violations == ()
    assert 'encoder x is stuck' in verdict.reason


def test_1_what_is_hidden_and_never_found_out(
    flown: Flown, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(BridgeStage, '_sensing_fault', lambda *_: None)
    monkeypatch.setattr(Supervisor, '_watch_following', lambda *_: None)
    texts = [text for rule, text in flown(*HIDDEN).violations if rule == 1]
    assert 'never found out' in texts[0]


@pytest.mark.parametrize(('others', 'hidden'), [(4e-5, True), (6e-5, False)])
def test_1_a_stuck_encoder_is_hidden_while_all_others_stand_still(
    others: float, hidden: bool
) -> None:
    judge = Judge(Flight(0))
    judge._n = 100
    judge._state[:100, 0] = 0.025
    judge._shift[50:100, 5] = 1e-5 * np.arange(50)
    judge._state[90, 2] = others
    assert judge._is_hidden((5,), 99) == hidden
    assert not judge._is_hidden((), 99)
    assert not judge._is_hidden(tuple(range(6)), 99)
    judge._state[90, 2], judge._state[40, 2] = 0.0, others  # before it was stuck
    assert judge._is_hidden((5,), 99)


def test_1_homing_finds_out_when_the_fault_is_latched() -> None:
    """Not when homing is refused, after a landing."""
    flight = Flight(0)
    flight.bridge.configure()
    judge = Judge(flight)
    observe, pressed = flight.world.observe, []

    def press() -> None:
        observe()
        state = judge.log()[0]
        if not pressed and state[-1, 0] < state[0, 0] - 2e-4:  # in the lift
            flight.world.stop_pressed = True
            pressed.append(len(state))

    flight.world.observe = press
    assert not flight.bridge.home()
    assert judge.reason == 'the emergency stop is pressed'
    assert judge.seen is not None
    assert judge.seen <= pressed[0] + 2
    assert len(judge.log()[0]) > judge.seen + 100


def test_2_a_landing_that_is_cut(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Landing, 'step', lambda *_: True)
    verdict = flown(KILLED, *ALOFT)
    assert 2 in broken(verdict)
    assert verdict.ended == 'cut'
    assert verdict.impact > 0.05


def test_2_a_cut_that_is_foretold_too_mildly(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    dead_board = Fault('call: persistent', (0,), call='write_analog')
    assert 2 not in broken(flown(dead_board, *ALOFT))
    mild = '; the platen strikes the upper stop at about 0.01 m/s'
    monkeypatch.setattr(faults, 'consequence_of_cut', lambda *_: mild)
    verdict = flown(dead_board, *ALOFT)
    assert verdict.impact > 0.2
    assert 2 in broken(verdict)


def test_2_a_cut_is_judged_by_the_hardest_stop_of_its_fall() -> None:
    """A tilting platen taps the lower stop with its edge, then the magnets lift it."""
    judge = Judge(Flight(0))
    judge._state[0] = 0.0
    judge._state[0, [0, 1, 8, 9]] = 0.03086, -0.044, 0.77e-3, 0.25
    assert judge._fall_from(0) > 0.3
    judge._state[0, [8, 9]] = 0.0
    assert 0.0 < judge._fall_from(0) < 0.05
    judge._state[0, [4, 5]] = 0.04, 0.2  # slides on, to the stop of z
    assert 0.1 < judge._fall_from(0) < 0.2


def test_3_outputs_left_on(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = Amplifiers.drive

    def cut(self: Amplifiers) -> Any:
        return self.arrays.volts

    def drive(self: Amplifiers, i_d: Any, i_q: Any, *place: float) -> Any:
        return sound(self, i_d, i_q, *place) if np.any(i_d) or np.any(i_q) else (0, 0)

    monkeypatch.setattr(Amplifiers, 'cut', cut)
    monkeypatch.setattr(Amplifiers, 'drive', drive)
    monkeypatch.setattr(Board, 'rest', lambda self: self.put_out(np.full(6, 0.5)))
    assert 3 in broken(flown(KILLED, 'rest', 0.5))


def test_4_enabled_with_the_stop_pressed(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Board, 'stop_pressed', lambda self: False)
    verdict = flown(Fault('stop input'), 'arming', 0.5)
    assert (4, 'amplifiers enabled with the stop pressed') in verdict.violations


def test_5_another_one_is_blamed(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = BridgeStage._raise_fault

    def raise_fault(self: BridgeStage, kind: str, _reason: str, *rest: Any, **more: Any) -> None:
        sound(self, kind, 'encoder gap 3 jumped', *rest, **more)

    monkeypatch.setattr(BridgeStage, '_raise_fault', raise_fault)
    assert 5 in broken(flown(KILLED, 'hover', 0.5))
    assert 5 not in broken(flown(Fault('jump: a gap', (2,), 300.0), 'hover', 0.5))


def test_6_boards_left_open(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Board, 'release', lambda self: None)
    assert 6 in broken(flown(KILLED, 'rest', 0.5))


def test_6_a_bridge_that_never_comes_back(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('maglev_study.faults.train._PATIENCE', 2.0)

    def hang(self: QuanserDriver) -> None:
        while True:
            pass

    monkeypatch.setattr(QuanserDriver, 'close', hang)
    verdict = flown(KILLED, 'rest', 0.5)
    assert verdict.violations == ((6, 'the run hangs'),)


@pytest.mark.parametrize(
    ('said', 'right'),
    [
        ('encoder gap 2, z jumped', True),
        ('encoder gap 2 is stuck, or its motors are', True),
        ('emergency stop; then encoder z jumped', True),
        ('the gaps contradict each other by 300 um', True),
        ('encoder gap 1, z jumped', False),
        ('encoder gap 2, z, x jumped', False),
        ('the currents commanded do not explain 11 rad/s^2 of phi', False),
    ],
)
def test_of_two_encoders_that_fail_one_sentence_may_name_both(said: str, *, right: bool) -> None:
    both = expected_of((Fault('noise: x or z', (5,), 80.0), Fault('slip: a gap', (1,), -21.0)))
    assert bool(re.search(both.blame, said)) == right


def test_of_an_encoder_and_another_fault_either_may_be_named() -> None:
    both = expected_of((Fault('slip: a gap', (1,), -21.0), Fault('stop service')))
    for said in ('encoder gap 2 jumped', 'emergency stop'):
        assert re.search(both.blame, said)
    assert not re.search(both.blame, 'encoder z jumped')
    assert not expected_of((Fault('slip: a gap', (1,), -21.0), KILLED)).stuck
