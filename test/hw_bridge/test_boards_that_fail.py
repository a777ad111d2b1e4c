"""Boards that do not do what they are told: what the driver does then, and how it leaves them."""

from __future__ import annotations

import contextlib
import re

import numpy as np
import pytest
from driven import LINES, driver_on, run, started
from hil_check import Module, Trouble

from maglev_hw_bridge.drivers import DriverError, WatchdogError


@pytest.mark.parametrize('board', [0, 1])
def test_a_board_that_cannot_be_told_keeps_its_watchdog(board: int) -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    run(driver)
    module.trouble = Trouble('write_analog', board)
    with pytest.raises(DriverError, match='stopping the boards failed: write_analog failed;'):
        driver.stop()
    bad, good = module.cards[board], module.cards[1 - board]
    assert bad.watchdog
    assert np.any(bad.volts[:6])
    assert not good.watchdog
    assert not np.any(good.volts[:6])
    assert not module.enabled  # what is possible is done
    held: list[bool] = []
    driver._sleep = lambda seconds: (held.append(good.open), module.sleep(seconds))  # type: ignore
    driver.close()
    assert bad.expired
    assert not np.any(bad.volts)
    assert module.time == pytest.approx(0.02, abs=1e-6)
    assert held == [False] * 4  # what is safe is given back at once


def test_how_often_a_board_is_told_what_it_does_not_do() -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    for kind, times in (('error', 3), ('interrupted', 3 * 6)):
        module.trouble = Trouble('write_analog', 1, kind=kind)
        before = module.cards[1].calls.count('write_analog')
        with pytest.raises(DriverError):
            driver.disable()
        assert module.cards[1].calls.count('write_analog') - before == times
    module.trouble = None
    driver.close()


def test_a_watchdog_that_was_never_started_is_not_stopped() -> None:
    module = Module()
    driver = driver_on(module)
    driver.open()
    driver.close()
    assert not any('watchdog_stop' in card.calls for card in module.cards)


@pytest.mark.parametrize('board', [0, 1])
def test_a_board_that_is_held_on_to_is_told_again(board: int) -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    run(driver)
    module.trouble = Trouble('write_analog', board)

    def answers_again(seconds: float) -> None:
        module.trouble = None
        module.sleep(seconds)

    driver._sleep = answers_again
    driver.close()
    card = module.cards[board]
    assert module.time == pytest.approx(0.005)
    assert not card.expired
    assert not card.watchdog
    assert not np.any(card.volts[:6])


def test_a_watchdog_that_expired_is_not_cleared_to_disable() -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    for card in module.cards:
        card.expire()
    with contextlib.suppress(DriverError):
        driver.disable()
    assert not any('watchdog_clear' in card.calls for card in module.cards)
    driver.close()


def test_what_says_nothing_is_named_by_its_kind() -> None:
    for error, words in ((OSError('no bus'), 'no bus'), (KeyError(), 'KeyError()')):
        module = Module()
        driver = driver_on(module)
        module.trouble = Trouble('HIL')
        module.trouble.error = lambda error=error: error  # type: ignore[method-assign,misc]
        with pytest.raises(DriverError, match=f'opening the boards failed: {re.escape(words)};'):
            driver.open()


@pytest.mark.parametrize('directions', [True, False])
def test_an_enable_line_that_cannot_be_told_is_let_go(directions: bool) -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    assert module.enabled
    refused = {'write_digital'} if directions else {'write_digital', 'set_digital_directions'}
    module.trouble = Trouble(refused, 0)
    if directions:
        driver.disable()
        assert not module.enabled
    else:  # then the watchdog does it
        with pytest.raises(DriverError):
            driver.disable()
    driver.close()
    assert module.cards[0].expired != directions
    assert not module.enabled


def test_one_failure_does_not_leave_the_enable_line_on() -> None:
    module = Module(enable_line=5)
    driver = started(module, **LINES)
    run(driver)
    module.trouble = Trouble('write_digital', 0, times=1)
    driver.stop()
    assert not module.enabled
    assert module.cards[0].calls[-1] == 'watchdog_stop'


@pytest.mark.parametrize('got', [0, None, 2])
def test_a_sample_task_that_has_stopped_is_lost_boards(
    got: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = Module()
    driver = started(module)
    run(driver)
    monkeypatch.setattr(type(module.cards[0]), 'task_read_encoder', lambda *_: got)
    with pytest.raises(DriverError, match='sample clock has stopped'):
        driver.read(np.zeros(6, dtype=np.int32))


def test_it_gives_up_on_a_call_that_is_interrupted_for_ever() -> None:
    module = Module()
    driver = started(module)
    module.trouble = Trouble('task_read_encoder', kind='interrupted')
    with pytest.raises(DriverError, match='interrupted'):
        driver.read(np.zeros(6, dtype=np.int32))
    assert module.cards[0].calls.count('task_read_encoder') < 10


@pytest.mark.parametrize('board', [0, 1])
def test_an_expired_watchdog_is_honoured(board: int) -> None:
    module = Module()
    driver = started(module)
    run(driver)
    module.cards[board].expire()
    written = [len(card.written) for card in module.cards]
    with pytest.raises(WatchdogError, match='watchdog expired'):
        driver.write(np.ones(12))
    assert [len(card.written) for card in module.cards] == written  # on neither board
    assert not np.any(module.cards[board].volts[:6])
    driver.close()
    assert 'watchdog_clear' in module.cards[board].calls
    assert not any(card.expired for card in module.cards)
