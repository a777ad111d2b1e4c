"""The calls the driver makes: types, shapes, order, and nothing after close."""

from __future__ import annotations

import _thread
import importlib
import signal
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from driven import LINES, driver_on, run, started
from hil_check import CallError, Module, Trouble

from maglev_hw_bridge.drivers import DriverError, WatchdogError, make_driver, quanser
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.contract.stage import StageError
from maglev_model.parameters import ParameterError, build

COUNTS = np.arange(8, dtype=np.int32) * 100 - 300


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
    driver = started(module)
    run(driver)
    driver.close()
    for card in module.cards:
        assert not card.open
        assert not np.any(card.volts[:6])
        assert not card.watchdog
    with pytest.raises(DriverError):
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


def test_samples_need_an_encoder_on_the_board_whose_clock_paces_them() -> None:
    driver_on(Module(), encoder__board=[0, 1, 1, 1, 1, 1])
    with pytest.raises(ParameterError, match=r"'encoder\.board' has no encoder on board 0"):
        driver_on(Module(), encoder__board=[1] * 6)


@pytest.mark.parametrize('board', [0, 1])
def test_what_a_reload_says_is_enough(board: int) -> None:
    module = Module()
    driver = started(module)
    run(driver)
    written = [len(card.written) for card in module.cards]
    module.trouble = Trouble('watchdog_reload', board, times=1, kind='wrong')
    with pytest.raises(WatchdogError):
        driver.write(np.ones(12))
    assert [len(card.written) for card in module.cards] == written


def test_a_watchdog_left_expired_by_a_crash_is_cleared_first() -> None:
    module = Module(left_expired=True)
    driver = driver_on(module)
    driver.open()
    for card in module.cards:
        assert card.calls[:2] == ['watchdog_is_expired', 'watchdog_clear']
    driver.close()


OFFSET = 0.25
CALLS = (
    'HIL', 'watchdog_is_expired', 'set_analog_output_ranges', 'write_analog', 'read_encoder',
    'set_digital_directions', 'read_digital', 'write_digital', 'task_create_encoder_reader',
    'task_start', 'task_read_encoder', 'task_stop', 'task_delete', 'watchdog_start',
    'watchdog_set_analog_expiration_state', 'watchdog_set_digital_expiration_state',
    'watchdog_reload', 'watchdog_stop', 'close',
)  # fmt: skip
UNKNOWABLE = {(call, 'wrong') for call in ('write_analog', 'write_digital', 'close')}
PHASES = ('open', 'start', 'run', 'disable', 'enable', 'stop', 'close')


def steps(driver: QuanserDriver) -> dict[str, Callable[[], object]]:
    """A session, step by step."""
    return {
        'open': driver.open,
        'start': driver.start,
        'run': lambda: run(driver),
        'disable': driver.disable,
        'enable': driver.enable,
        'stop': driver.stop,
        'close': driver.close,
    }


@pytest.mark.parametrize('board', [0, 1])
@pytest.mark.parametrize('call', CALLS)
def test_whatever_a_call_does_it_ends_without_current_and_comes_back(call: str, board: int) -> None:
    """Each call x {once, for ever, interrupted, something foreign, wrong} x when it begins."""
    kinds = [('error', 1.0), ('error', np.inf), ('foreign', 1.0), ('foreign', np.inf)]
    kinds += [('interrupted', 2.0), ('interrupted', np.inf), ('wrong', 1.0), ('wrong', np.inf)]
    for kind, times in kinds:
        if (call, kind) in UNKNOWABLE:
            continue
        for begins in PHASES:
            module = Module(offset=OFFSET, enable_line=5)
            driver = driver_on(module, amplifier__offset=[OFFSET] * 12, **LINES)
            failed = False
            for name, step in steps(driver).items():
                if name == begins:
                    module.trouble = Trouble(call, board, times, kind)
                try:
                    step()
                except DriverError:
                    failed = True
                    break
            if kind == 'interrupted' and times == 2.0 and call != 'HIL':
                assert not failed, 'a call that a signal interrupts is made again'
            began = module.time
            driver.close()
            assert module.time - began <= 0.025 + 1e-9
            if call == 'close' and times == np.inf:
                continue  # nothing gives this handle back
            module.check_end()
            module.trouble = None
            driver.open()  # a restart works
            driver.start()
            run(driver)
            driver.stop()
            driver.close()
            module.check_end()


@pytest.mark.parametrize(('slower', 'late'), [(4e-4, False), (8e-4, True)])
def test_boards_whose_clock_is_a_little_slow_are_not_late(slower: float, late: bool) -> None:
    module = Module()
    parameters = build(BridgeParameters, {'boards.overrun': 1e-3})

    def clock() -> float:
        return module.cards[0].ticks * 1e-3 * (1.0 + slower)

    driver = QuanserDriver(parameters, module, clock, module.sleep)
    driver.open()
    driver.start()
    run(driver, 5_000)  # by the tick, 2 and 4 ms behind this machine's clock
    assert (driver.late > parameters.boards.overrun) == late
    driver.close()


def test_started_again_it_counts_its_ticks_and_their_time_anew() -> None:
    module, now = Module(), [0.0]
    driver = QuanserDriver(BridgeParameters(), module, lambda: now[0], module.sleep)
    assert (driver.late, driver.stop_pressed) == (0.0, False)
    driver.open()
    driver.start()
    run(driver, 3)
    now[0] = 0.5  # it stood still before the last sample
    run(driver, 1)
    assert driver.late == pytest.approx(0.499, abs=1e-5)
    driver.stop()
    now[0] = 20.0
    driver.start()
    assert driver.late == 0.0
    run(driver, 1)
    assert driver.late == 0.0
    now[0] += 0.003
    run(driver, 1)
    assert driver.late == pytest.approx(0.002, abs=1e-5)
    driver.close()


def test_with_the_vendors_module_its_driver_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    module = Module()
    monkeypatch.setattr(importlib, 'import_module', {'quanser.hardware': module}.__getitem__)
    driver = quanser.make(BridgeParameters(), realtime=True)
    driver.open()
    assert [card.open for card in module.cards] == [True, True]
    driver.close()


def test_signals_interrupt_no_read() -> None:
    """While it waits for a sample, the thread of the loop has them blocked; not afterwards."""
    module = Module()
    driver = driver_on(module)
    seen: list[set[signal.Signals]] = []

    def blocked() -> set[signal.Signals]:
        return signal.pthread_sigmask(signal.SIG_BLOCK, [])  # type: ignore[return-value]

    driver.open()
    driver.start()
    card = module.cards[0]
    read = card.task_read_encoder
    object.__setattr__(card, 'task_read_encoder', lambda *a: seen.append(blocked()) or read(*a))
    run(driver, 1)
    assert {signal.SIGINT, signal.SIGTERM, signal.SIGHUP} <= seen[0]
    assert not blocked() & {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    driver.close()


def test_no_signal_breaks_off_a_close() -> None:
    """One that another thread has taken is handled in this one, whatever it blocks."""
    module = Module()
    driver = started(module)
    for card in module.cards:
        stop = card.watchdog_stop
        object.__setattr__(card, 'watchdog_stop', partial(_signalled, stop))
    with pytest.raises(KeyboardInterrupt):
        driver.close()
    assert not any(card.open or card.watchdog for card in module.cards)
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


def _signalled(call: Callable[[], object]) -> object:
    _thread.interrupt_main(signal.SIGINT)
    return call()


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


def module_in(folder: Path, name: str, text: str) -> None:
    """A module ``package.name`` that can be imported once the folder is on the path."""
    path = folder / f'{name.replace(".", "/")}.py'
    path.parent.mkdir()
    path.write_text(text)


def test_without_the_library_that_the_vendors_module_loads_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module_in(tmp_path, 'quanser.hardware', 'raise OSError("cannot load library \'hil\'")')
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(DriverError, match=r"cannot load library 'hil'; it and .*quanser\.com"):
        make_driver(build(BridgeParameters, {'driver': 'quanser'}), realtime=True)
    del sys.modules['quanser']


def test_a_driver_that_lacks_a_call_is_refused_before_it_is_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    has = ('late', 'stop_pressed', 'open', 'counts', 'start', 'read', 'write', 'stop', 'close')
    text = 'from types import SimpleNamespace\n\n\ndef make(parameters, realtime):\n'
    text += f'    return SimpleNamespace(**dict.fromkeys({has!r}))\n'
    module_in(tmp_path, 'half_a.driver', text)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(
        ParameterError, match=r"'half_a\.driver', a driver without disable, enable$"
    ):
        make_driver(build(BridgeParameters, {'driver': 'half_a.driver'}), realtime=True)


@pytest.mark.parametrize(
    ('call', 'told'),
    [
        ('open', r'raised OSError: no device \(driver\.py, line \d+\)'),
        ('counts', r'raised OSError: no device \(driver\.py, line \d+\)'),
        ('returned', r"left 6 of the 6 encoders out: 'counts' and 'read' must write"),
    ],
)
def test_a_driver_of_ones_own_that_goes_wrong_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str, told: str
) -> None:
    """Counts that are returned, in place of written, would be read as zeros."""
    name = f'own_{call}.driver'
    module_in(
        tmp_path,
        name,
        'from types import SimpleNamespace\n\n\n'
        'def fails(*given):\n    raise OSError("no device")\n\n\n'
        'def make(parameters, realtime):\n'
        "    calls = ('open', 'start', 'read', 'write', 'disable', 'enable', 'stop', 'close')\n"
        '    does = dict.fromkeys(calls, lambda *given: None)\n'
        "    does['counts'] = lambda counts: [0] * 6\n"
        f'    does.update({{{call!r}: fails}})\n'
        '    return SimpleNamespace(late=0.0, stop_pressed=False, **does)\n',
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    stage = BridgeStage(build(BridgeParameters, {'driver': name, 'homing.at_start': False}))
    with pytest.raises(StageError, match=rf"^parameter 'driver' is '{name}', which {told}"):
        stage.configure()


def test_nothing_else_imports_the_vendors_module() -> None:
    code = (
        'import sys, maglev_hw_bridge.stage; assert not any("quanser.h" in m for m in sys.modules)'
    )
    assert subprocess.run([sys.executable, '-c', code], check=False).returncode == 0
