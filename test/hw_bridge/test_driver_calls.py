"""The calls the driver makes: types, shapes, order, and nothing after close."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from hil_check import CallError, Module

from maglev_hw_bridge.drivers import DriverError, WatchdogError, make_driver
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build

COUNTS = np.arange(8, dtype=np.int32) * 100 - 300


def driver_on(module: Module, **overrides: object) -> QuanserDriver:
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return QuanserDriver(build(BridgeParameters, names), module, lambda: 0.0)


def run(driver: QuanserDriver, samples: int = 5) -> np.ndarray:
    counts = np.zeros(6, dtype=np.int32)
    for k in range(samples):
        driver.read(counts)
        driver.write(np.linspace(-7.0, 7.0, 12) * ((k + 1) / samples))
    return counts


def session(driver: QuanserDriver) -> None:
    driver.open()
    driver.start()
    run(driver)
    driver.stop()


def test_a_whole_session() -> None:
    module = Module()
    module.counts = COUNTS
    driver = driver_on(module)
    driver.open()
    counts = np.zeros(6, dtype=np.int32)
    driver.counts(counts)
    assert counts.tolist() == COUNTS[:6].tolist()
    driver.start()
    assert run(driver).tolist() == COUNTS[:6].tolist()
    for card, part in zip(module.cards, (slice(0, 6), slice(6, 12)), strict=True):
        assert card.written[-1].tolist() == np.linspace(-7.0, 7.0, 12)[part].tolist()
        assert card.reloads == 5
    assert module.cards[0].ticks == 5
    driver.stop()
    driver.start()  # and once more
    run(driver)
    driver.stop()
    driver.close()
    driver.close()
    assert [card.open for card in module.cards] == [False, False]


def test_closing_in_flight_leaves_nothing_behind() -> None:
    module = Module()
    driver = driver_on(module)
    driver.open()
    driver.start()
    run(driver)
    driver.close()
    for card in module.cards:
        assert not card.open
        assert not np.any(card.volts[:6])
        assert not card.watchdog
    with pytest.raises(AttributeError):
        driver.read(np.zeros(6, dtype=np.int32))


def test_encoders_on_both_boards_and_phases_crossed() -> None:
    module = Module()
    module.counts = COUNTS
    driver = driver_on(
        module,
        encoder__board=[0, 1, 0, 1, 0, 1],
        encoder__channel=[7, 0, 6, 1, 5, 2],
        amplifier__board=[1, 0] * 6,
        amplifier__channel=[0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5],
    )
    driver.open()
    driver.start()
    assert run(driver, 1).tolist() == COUNTS[[7, 0, 6, 1, 5, 2]].tolist()
    volts = np.linspace(-7.0, 7.0, 12)
    assert module.cards[0].written[-1].tolist() == volts[1::2].tolist()
    assert module.cards[1].written[-1].tolist() == volts[0::2].tolist()
    driver.close()


@pytest.mark.parametrize('board', [0, 1])
def test_an_expired_watchdog_is_honoured(board: int) -> None:
    module = Module()
    driver = driver_on(module)
    driver.open()
    driver.start()
    run(driver)
    module.cards[board].expire()
    with pytest.raises(WatchdogError, match='watchdog expired'):
        driver.write(np.ones(12))
    assert not np.any(module.cards[board].volts[:6])
    driver.close()
    assert 'watchdog_clear' in module.cards[board].calls
    assert not any(card.expired for card in module.cards)


def test_a_watchdog_left_expired_by_a_crash_is_cleared_first() -> None:
    module = Module(left_expired=True)
    driver = driver_on(module)
    driver.open()
    for card in module.cards:
        assert card.calls[:2] == ['watchdog_is_expired', 'watchdog_clear']
    driver.close()


@pytest.mark.parametrize(
    'call',
    ['HIL', 'set_analog_output_ranges', 'write_analog', 'watchdog_start', 'task_start',
     'task_create_encoder_reader', 'task_read_encoder', 'watchdog_reload', 'task_stop'],
)  # fmt: skip
def test_an_error_anywhere_is_explained_and_everything_released(call: str) -> None:
    module = Module()
    module.fail_at = call
    driver = driver_on(module)
    with pytest.raises(DriverError, match=r'failed.*check'):
        session(driver)
    driver.close()
    assert not any(card.open for card in module.cards)


def test_enable_output_and_stop_input() -> None:
    module = Module()
    driver = driver_on(module, boards__stop_input=3, boards__enable_output=5)
    driver.open()
    assert module.enabled is False
    driver.start()
    assert module.enabled is True
    run(driver, 1)
    assert not driver.stop_pressed
    module.stop_level = 0
    run(driver, 1)
    assert driver.stop_pressed
    driver.stop()
    assert module.enabled is False
    driver.close()


def test_the_check_finds_wrong_types() -> None:
    card = Module().HIL('q8', '0')
    with pytest.raises(CallError, match='int64'):
        card.read_encoder(np.arange(6), 6, np.zeros(6, dtype=np.int32))
    with pytest.raises(CallError, match='float32'):
        card.write_analog(np.arange(2, dtype=np.uint32), 2, np.zeros(2, dtype=np.float32))
    card.set_analog_output_ranges(np.arange(1, dtype=np.uint32), 1, -np.ones(1), np.ones(1))
    with pytest.raises(CallError, match='no expiration state'):
        card.watchdog_start(0.02)


def test_without_the_vendors_module_it_says_how_to_get_it() -> None:
    with pytest.raises(DriverError, match=r'quanser\.com'):
        make_driver(build(BridgeParameters, {'driver': 'quanser'}), realtime=True)
    with pytest.raises(ParameterError, match='realtime'):
        make_driver(build(BridgeParameters, {'driver': 'quanser'}), realtime=False)
    with pytest.raises(ParameterError, match='one of emulated, quanser'):
        make_driver(build(BridgeParameters, {'driver': 'qanser'}), realtime=True)


def test_nothing_else_imports_the_vendors_module() -> None:
    code = (
        'import sys, maglev_hw_bridge.stage; assert not any("quanser.h" in m for m in sys.modules)'
    )
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0
