"""The last line is proven to somebody who takes a second to answer, and what is wrong is named."""

from __future__ import annotations

import functools
import os
import re
import select
from collections.abc import Callable

import numpy as np
import pytest
from proving import nothing, prove

from maglev_hw_bridge.commissioning.operators import Person
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.emulation.card import EmulatedCard


def test_the_last_line_is_proven() -> None:
    where, *told = prove({})
    assert where.endswith('at motor 1 phase a and motor 4 phase c')
    assert [line.split(':')[0].strip() for line in told] == [
        'stop input', 'enable line', 'watchdog', 'emergency stop',
    ]  # fmt: skip
    assert all(line.endswith('pass') for line in told)
    _, *told = prove({'boards.stop_input': -1, 'boards.enable_output': -1})
    assert 'no emergency stop to prove' in told[0]
    assert 'no enable line to prove' in told[1]
    told = prove({'boards.enable_output': -1})
    assert told[-1] == '  emergency stop: no current: pass'


@pytest.mark.parametrize(
    ('claimed', 'text'),
    [
        ({'emulation.wiring.stop_level': 0}, r'stop_level must be 0'),
        ({'emulation.wiring.stop_line': 4}, r'stop_input \(0\) is another line'),
        ({'boards.stop_level': 0}, 'broken wire'),
        ({'emulation.wiring.enable_level': 1}, 'wrong way round'),
        ({'emulation.wiring.enable_line': 4}, r'enable_output \(1\) is another line'),
    ],
)
def test_a_last_line_that_is_wired_otherwise(claimed: dict[str, object], text: str) -> None:
    with pytest.raises(WrongError, match=text):
        prove(claimed)


def never_enabled(boards: EmulatedBoards) -> None:
    boards.lines._enable_level = 2


def always_enabled(boards: EmulatedBoards) -> None:
    boards.lines._enable = -1


def stays_enabled(boards: EmulatedBoards) -> None:
    boards.lines.let_go = lambda _expired: None  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ('spoil', 'text'),
    [
        (never_enabled, 'flows at motor 1 phase a and motor 4 phase c even when enabled'),
        (always_enabled, 'whether enabled or not'),
        (stays_enabled, 'enabled after the watchdog expired'),
    ],
)
def test_a_last_line_that_does_not_work(spoil: Callable[[EmulatedBoards], None], text: str) -> None:
    with pytest.raises(WrongError, match=text):
        prove({}, spoil)


LOADS = {0: 'motor 1 phase a', 1: 'motor 4 phase c'}
BOARDS = np.repeat([0, 1], 6)


def off_the_line(board: int, boards: EmulatedBoards) -> None:
    advance = boards.rig.advance
    boards.rig.advance = lambda volts: advance(  # type: ignore[method-assign]
        np.where(board == BOARDS, boards.outputs(), volts)
    )


def without_supply(board: int, boards: EmulatedBoards) -> None:
    advance = boards.rig.advance
    boards.rig.advance = lambda volts: advance(  # type: ignore[method-assign]
        np.where(board == BOARDS, boards._no_current, volts)
    )


@pytest.mark.parametrize('board', [0, 1])
def test_amplifiers_of_one_board_that_do_not_obey(board: int) -> None:
    load = LOADS[board]
    with pytest.raises(WrongError, match=f'current flows at {load} whether enabled or not'):
        prove({}, functools.partial(off_the_line, board))
    with pytest.raises(WrongError, match=f'no current flows at {load} even when enabled'):
        prove({}, functools.partial(without_supply, board))
    with pytest.raises(WrongError, match=f'no current flows at {load}: check amplifier'):
        prove({'boards.enable_output': -1}, functools.partial(without_supply, board))


@pytest.mark.parametrize('board', [0, 1])
def test_outputs_of_one_board_that_outlive_its_watchdog(
    board: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    expire = EmulatedCard.expire

    def hold(card: EmulatedCard) -> None:
        card._expiration = card._number != board
        expire(card)

    monkeypatch.setattr(EmulatedCard, 'expire', hold)
    with pytest.raises(WrongError, match=f'current flows on at {LOADS[board]} after the watchdog'):
        prove({'boards.enable_output': -1})


@pytest.mark.parametrize('boards', ['0', '1', '01'])
@pytest.mark.parametrize('factor', [45, 1e6])
def test_a_watchdog_that_expires_late_or_never(
    factor: float, boards: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of either board; by when the operator has looked, the first factor's has expired."""
    start = EmulatedCard.watchdog_start

    def start_late(card: EmulatedCard, timeout: float) -> None:
        start(card, factor * timeout if card._identifier in boards else timeout)

    monkeypatch.setattr(EmulatedCard, 'watchdog_start', start_late)
    named = f'watchdog of board {" and ".join(boards)} did not expire within 0.04 s'
    with pytest.raises(WrongError, match=re.escape(named)):
        prove({})


def stretched(boards: EmulatedBoards) -> None:
    sleep = boards.sleep
    boards.sleep = lambda seconds: sleep(2.0 * seconds)  # type: ignore[method-assign]


def test_a_wait_that_a_busy_machine_stretches_proves_no_watchdog() -> None:
    with pytest.raises(WrongError, match=r'took 0\.080 s for a wait of 0\.04 s'):
        prove({}, stretched)


class DisablesNothing(QuanserDriver):
    """Where the emergency stop is pressed."""

    def disable(self) -> None:
        """Not then."""
        if not self.stop_pressed:
            super().disable()


def test_a_driver_that_disables_nothing_once_the_stop_is_pressed() -> None:
    with pytest.raises(WrongError, match=r'current flows on at .* after an emergency stop'):
        prove({}, nothing, DisablesNothing)


def pressed_by_current(boards: EmulatedBoards) -> None:
    tick = boards.tick

    def pressing() -> None:
        tick()
        boards.stop_pressed |= boards.rig.phase_current[0] > 0.4

    boards.tick = pressing  # type: ignore[method-assign]


def test_a_stop_that_is_pressed_before_its_turn_ends_the_proof() -> None:
    with pytest.raises(WrongError, match='the emergency stop is pressed'):
        prove({}, pressed_by_current)


@pytest.mark.parametrize(('answer', 'seen'), [('n', False), ('yes', True)])
def test_current_flows_on_until_somebody_answers_clearly(
    answer: str, seen: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal, keyboard = os.pipe()
    typed = ['', '\n', '', f'{answer}\n']
    with open(terminal) as stdin, open(keyboard, 'w', buffering=1) as keys:
        monkeypatch.setattr('sys.stdin', stdin)
        assert Person().sees_current(3, lambda: print(typed.pop(0), end='', file=keys)) == seen
    assert not typed


def test_what_was_typed_before_it_is_asked_answers_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    keyboard, terminal = os.openpty()
    os.write(keyboard, b'y\n')
    with open(terminal) as stdin, open(keyboard, 'wb', buffering=0) as keys:
        select.select([stdin], [], [])
        monkeypatch.setattr('sys.stdin', stdin)
        assert not Person().sees_current(3, lambda: keys.write(b'n\n'))


def test_where_nobody_can_answer_nothing_is_agreed_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr('sys.stdin', None)
    for asked in (Person().go_on, Person().sees_current):
        with pytest.raises(EOFError):
            asked(0)  # type: ignore[operator]
