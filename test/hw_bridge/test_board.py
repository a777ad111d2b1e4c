"""One board, call by call: its lines, its ranges, and what it is left as when it does not obey."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from driven import LINES, bridge_parameters, started
from hil_check import Card, Module, Trouble

from maglev_hw_bridge.board import Board
from maglev_hw_bridge.drivers import DriverError, WatchdogError
from maglev_hw_bridge.parameters import BridgeParameters


def board_on(module: Module, number: int = 0, **names: object) -> tuple[Board, Card]:
    """A board that was opened, and the card that it stands for."""
    board = Board(bridge_parameters(**names), number)
    board.card = module.HIL('q8', str(number))  # type: ignore[call-arg]
    return board, module.cards[-1]


@pytest.mark.parametrize(('stop', 'enable'), [(0, 1), (1, 0), (3, 5)])
def test_any_lines_of_the_first_board_will_do(stop: int, enable: int) -> None:
    module = Module(enable_line=enable)
    lines = {'boards.stop_input': stop, 'boards.enable_output': enable}
    board, _ = board_on(module, **lines)
    board.prepare()
    assert not module.enabled
    board.enable(True)
    assert module.enabled
    for level in (1, 0):
        module.stop_level = level
        assert board.stop_pressed() == bool(level)


@pytest.mark.parametrize('lines', [{'boards.stop_input': 3}, {'boards.enable_output': 5}])
def test_either_line_alone_has_its_direction_set(lines: dict[str, int]) -> None:
    board, card = board_on(Module(), **lines)
    board.prepare()
    assert 'set_digital_directions' in card.calls
    assert np.flatnonzero(card.outputs).tolist() == [5] * ('boards.enable_output' in lines)


def test_without_lines_none_is_touched_and_nothing_is_pressed() -> None:
    module = Module()
    module.stop_level = 1
    board, card = board_on(module)
    board.prepare()
    board.enable(True)
    assert not board.stop_pressed()
    assert not any('digital' in call for call in card.calls)


@pytest.mark.parametrize('number', [0, 1])
def test_its_outputs_get_their_range(number: int) -> None:
    board, card = board_on(Module(), number)
    board.prepare()
    volts = BridgeParameters().amplifier.voltage_range
    assert card.ranges == dict.fromkeys(board.outputs.tolist(), volts)
    assert card.calls.index('set_analog_output_ranges') < card.calls.index('write_analog')


def test_the_enable_line_is_off_from_when_it_is_driven() -> None:
    module = Module(enable_line=5)
    board, card = board_on(module, **LINES)
    seen: list[int] = []

    def directions(*given: Any) -> None:
        seen.append(int(card.latch[5]))
        card.latch[5] = 0  # as a card may that forgets what was written before
        Card.set_digital_directions(card, *given)

    card.set_digital_directions = directions  # type: ignore[method-assign]
    board.prepare()
    assert seen == [1]
    assert not module.enabled


def test_a_watchdog_that_does_not_answer_has_not_expired() -> None:
    module = Module()
    driver = started(module)
    module.trouble = Trouble({'task_read_encoder', 'watchdog_is_expired'})
    with pytest.raises(DriverError, match='reading a sample failed') as raised:
        driver.read(np.zeros(6, dtype=np.int32))
    assert not isinstance(raised.value, WatchdogError)


@pytest.mark.parametrize('number', [0, 1])
def test_a_call_that_an_expired_watchdog_refuses_is_told_as_that(number: int) -> None:
    module = Module()
    driver = started(module)
    module.cards[number].expire()
    with pytest.raises(WatchdogError, match='watchdog expired'):
        driver.enable()


def test_a_board_that_is_not_open_is_safe() -> None:
    board = Board(BridgeParameters(), 0)
    assert board.make_safe() == []
    assert board.calm
    board.release()
    assert board.calm


@pytest.mark.parametrize('starts', [True, False])
def test_what_was_cleared_and_is_not_safe_gets_its_watchdog_back(starts: bool) -> None:
    module = Module()
    board, card = board_on(module)
    board.prepare()
    card.expire()
    module.trouble = Trouble('write_analog' if starts else {'write_analog', 'watchdog_start'})
    assert [str(problem.get_error_message()) for problem in board.make_safe()]  # type: ignore
    assert not board.calm
    assert (board.armed, card.watchdog) == (starts, starts)
    assert card.calls.count('watchdog_start') == (1 if starts else 3)


def test_what_was_not_cleared_has_the_watchdog_that_it_has() -> None:
    module = Module()
    board, card = board_on(module)
    board.prepare()
    module.trouble = Trouble('write_analog')
    board.make_safe()
    assert 'watchdog_start' not in card.calls
    assert not board.armed


@pytest.mark.parametrize('open_level', [0, 1])
def test_an_enable_line_is_let_go_only_where_open_means_off(open_level: int) -> None:
    module = Module(enable_line=5)
    expiry = {'boards.open_level': open_level, 'boards.digital_expiry': 'high'}
    board, card = board_on(module, **LINES, **expiry)
    board.prepare()
    board.enable(True)
    told = card.calls.count('set_digital_directions')
    module.trouble = Trouble('write_digital')
    problems = board.make_safe()
    assert bool(problems) == (open_level == 0)
    assert (card.calls.count('set_digital_directions') > told) == (open_level == 1)
    assert board.calm == (open_level == 1)
