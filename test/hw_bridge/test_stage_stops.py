"""Emergency stops, and landings that end before the platen is down; nothing flies."""

from __future__ import annotations

import re

import numpy as np
import pytest
from made_up import LOWER_STOP, active, aloft, watched

from maglev_hw_bridge import amplifiers
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.sensing.guard_arrays import LOST
from maglev_hw_bridge.stage import BridgeStage, Mode

STOP_TIME = 1.5
LONGEST = 1500  # samples
STRIKES = r'; the platen strikes the upper stop at about 0\.\d\d m/s'


def descend(stage: BridgeStage, samples: int = 1, y: float = 0.025) -> None:
    """Land for so many samples, and be no nearer the end."""
    for _ in range(samples):
        watched(stage, y)
        stage.landing.begin(stage.guard.arrays.position, np.zeros(5))
        stage._descend()


def cut(stage: BridgeStage) -> str:
    """Why a landing was cut."""
    assert stage.mode is Mode.DISABLED
    assert stage.fault is not None
    assert stage.fault.cut
    return stage.fault.reason


@pytest.mark.parametrize(('kind', 'ends'), [('stop', True), ('encoder', False)])
def test_only_a_landing_for_a_stop_has_a_longest_time(kind: str, *, ends: bool) -> None:
    stage, _ = active(boards__stop_time=STOP_TIME)
    aloft(stage)
    stage.stop('for a test', kind)
    descend(stage, LONGEST)
    assert stage.mode is Mode.LANDING
    descend(stage)
    assert stage.mode is (Mode.DISABLED if ends else Mode.LANDING)


def test_a_landing_that_is_too_long_tells_how_hard_the_platen_strikes() -> None:
    stage, _ = active(boards__stop_time=STOP_TIME)
    aloft(stage)
    stage.stop('for a test')
    descend(stage, LONGEST + 1)
    first = r'for a test; then the platen is not down 1\.5 s after the emergency stop'
    assert re.match(first + STRIKES, cut(stage))


@pytest.mark.parametrize('fault', ['', 'for another'])
@pytest.mark.parametrize('pressed', [False, True])
def test_a_stop_during_another_landing_has_its_longest_time_from_then_on(
    fault: str, *, pressed: bool
) -> None:
    stage, boards = active(boards__stop_time=STOP_TIME)
    aloft(stage)
    if fault:
        stage.stop(fault, 'encoder')
    else:
        stage.land('for a test')
    descend(stage, 700)
    if pressed:
        press(stage, boards)
    else:
        stage.stop('by somebody')
    descend(stage, 700)
    stage.stop('once more')  # from the first one on
    descend(stage, LONGEST - 700)
    assert stage.mode is Mode.LANDING
    descend(stage)
    assert 'not down' in cut(stage)


def stopped_as_long_as_may_be() -> BridgeStage:
    """One that has landed since an emergency stop for as long as it may."""
    stage, _ = active(boards__stop_time=STOP_TIME)
    aloft(stage)
    stage.stop('for a test')
    descend(stage, LONGEST)
    return stage


def test_what_is_found_out_meanwhile_gives_a_stop_no_more_time() -> None:
    stage = stopped_as_long_as_may_be()
    stage.guard.arrays.trust[:2] = LOST
    stage.guard.arrays.blamed[:2] = 1
    stage._sensing_fault(guard.STUCK, 0)
    descend(stage)
    assert 'not down' in cut(stage)


def test_the_next_landing_is_for_no_stop_of_the_last_flight() -> None:
    stage = stopped_as_long_as_may_be()
    stage._disable()
    stage.read()
    assert stage.reset()[0]
    aloft(stage)
    stage.land('for a test')
    descend(stage, 2 * LONGEST)
    assert stage.mode is Mode.LANDING


@pytest.mark.parametrize(
    ('code', 'why'),
    [
        (amplifiers.FINE, ''),
        (amplifiers.SPENT, ''),
        (amplifiers.OVER_CURRENT, 'motor 2 phase a was to carry 0.0 A'),
        (amplifiers.OVER_LIMIT, 'motor 4 was commanded 0.0 A'),
        (amplifiers.NOT_FINITE, 'i_d, i_q of motor 4 are 0.0, 0.0: they must be finite'),
    ],
)
@pytest.mark.parametrize('fault', ['', 'for a test'])
def test_currents_of_a_landing_that_are_refused_end_it_and_say_how_hard(
    monkeypatch: pytest.MonkeyPatch, code: int, why: str, fault: str
) -> None:
    stage, _ = active()
    aloft(stage)
    if fault:
        stage.stop(fault, 'range')
    else:
        stage.land('for a test')
    monkeypatch.setattr(stage, '_drive', lambda *_: (code, 3))
    monkeypatch.setattr(stage.landing, 'step', lambda *_: False)
    stage.landing.direct_current[:] = stage.landing.quadrature_current[:] = 0.0
    stage._descend()
    if not why:
        assert stage.mode is Mode.LANDING
        return
    before = f'{fault}; then ' if fault else ''
    said = re.escape(f'{before}the landing is given up: {why}')
    assert re.fullmatch(said + STRIKES, cut(stage))


def press(stage: BridgeStage, boards: EmulatedBoards, *, pressed: bool = True) -> None:
    boards.stop_pressed = pressed
    stage.read()
    if stage.mode is Mode.DISABLED:  # so that the watchdog does not expire
        stage.hold()
    watched(stage)


def latched(stage: BridgeStage) -> None:
    """At rest, with a fault that is no stop."""
    stage.read()
    watched(stage, LOWER_STOP)
    stage.stop('for a test', 'range')
    assert stage.mode is Mode.DISABLED


def test_a_stop_while_a_fault_is_latched_refuses_one_reset() -> None:
    stage, _ = active()
    stage.stop('first')
    stage.stop('second')
    cleared, why = stage.reset()
    assert not cleared
    assert 'second' in why
    assert stage.reset() == (True, 'cleared: first')


def test_a_stop_pressed_beside_a_fault_refuses_one_reset_also_when_released() -> None:
    stage, boards = active()
    latched(stage)
    press(stage, boards)
    press(stage, boards, pressed=False)
    stage.read()
    cleared, why = stage.reset()
    assert not cleared
    assert 'the emergency stop is pressed' in why
    assert stage.reset() == (True, 'cleared: for a test')


@pytest.mark.parametrize(('samples', 'anew'), [(99, False), (100, True)])
def test_what_bounces_is_pressed_once(samples: int, *, anew: bool) -> None:
    """A stop that is a fault of its own needs one reset, unless somebody presses it again."""
    stage, boards = active()
    stage.read()
    press(stage, boards)
    press(stage, boards)
    assert stage.fault is not None
    assert stage.fault.kind == 'stop'
    for _ in range(samples):
        press(stage, boards, pressed=False)
    press(stage, boards)
    press(stage, boards, pressed=False)
    stage.read()
    assert stage.reset()[0] == (not anew)


def test_as_long_as_it_is_pressed_it_stops() -> None:
    stage, boards = active()
    stage.read()
    press(stage, boards)
    stage.fault = None
    press(stage, boards)
    assert stage.fault is not None
    assert stage.fault.kind == 'stop'
