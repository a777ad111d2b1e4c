"""What one part of a stage's life leaves to the next: loads, faults, currents, homes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from bridge_flight import HOME, Flight, hover
from made_up import Clock, active, refusing, volts
from wired import OFFSET, bridge

from maglev_hw_bridge.drivers import DriverError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import Fault, StageError
from maglev_model.parameters import build

LOAD = 0.4  # I2t that was left of a life


def with_current(stage: BridgeStage, boards: EmulatedBoards) -> None:
    """Let a current flow that does not lift the platen."""
    stage.read()
    stage.write(np.full(4, 0.1), np.zeros(4))
    assert volts(boards) != OFFSET


def lose(stage: BridgeStage, boards: EmulatedBoards) -> None:
    """Have the boards fail for one read."""
    boards.failing = True
    with pytest.raises(StageError):
        stage.read()
    boards.failing = False


def test_a_new_stage_has_nothing_latched_and_no_current() -> None:
    stage, _ = bridge()
    assert (stage.mode, stage.flying, stage.why, stage.fault) == (Mode.CLOSED, False, '', None)


def test_without_a_driver_it_makes_the_one_that_is_asked_for() -> None:
    emulated = BridgeStage(build(BridgeParameters, HOME))
    assert isinstance(emulated.truth(), tuple)
    with pytest.raises(StageError, match=r'quanser\.hardware'):
        BridgeStage(build(BridgeParameters, {'driver': 'quanser'}), realtime=True)


def test_what_cools_between_two_lives_is_cooler_in_the_second(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = Clock(monkeypatch)
    stage, _ = active()
    thermal_time = stage.parameters.amplifier.thermal_time
    clock.now += 500.0
    stage.amplifiers.arrays.load[2] = LOAD
    stage.deactivate()
    clock.now += thermal_time
    stage.close()
    clock.now += thermal_time
    stage.configure()
    assert stage.amplifiers.arrays.load[2] == pytest.approx(LOAD * math.exp(-1.0))
    clock.now += thermal_time
    stage.activate()
    assert stage.amplifiers.arrays.load[2] == pytest.approx(LOAD * math.exp(-2.0))


def test_what_was_remembered_does_not_cool_what_is_hotter(monkeypatch: pytest.MonkeyPatch) -> None:
    Clock(monkeypatch)
    stage, _ = active()
    stage.amplifiers.arrays.load[2] = LOAD
    stage.deactivate()
    stage.close()
    monkeypatch.setattr(stage.memory, 'recall', lambda: (np.full(12, 0.3), None))
    stage.configure()
    assert stage.amplifiers.arrays.load.tolist() == [0.3, 0.3, LOAD] + [0.3] * 9


def test_counts_of_before_are_the_start_not_a_leap() -> None:
    start = {'emulation__wiring__encoder_start': [2**31 - 5, -7, 3, 2**31 - 1, -(2**31), 12]}
    stage, _ = bridge(homing__at_start=False, **start)
    stage.configure()
    assert stage.encoders.arrays.total.tolist() == start['emulation__wiring__encoder_start']


@pytest.mark.parametrize('how', ['deactivate', 'close', 'reset', 'lost', 'landed'])
def test_currents_of_before_do_not_come_back(how: str) -> None:
    stage, boards = active()
    with_current(stage, boards)
    if how == 'reset':
        stage.stop()
        assert stage.reset()[0]
    elif how == 'landed':
        stage.land('for a test')
        stage.resume()
    elif how == 'lost':
        lose(stage, boards)
        assert stage.reset()[0]
    else:
        stage.deactivate()
        if how == 'close':
            stage.close()
            stage.configure()
        stage.activate()
    assert stage.mode is Mode.FOLLOWING
    stage.read()
    assert not np.any(stage.amplifiers.arrays.current)
    stage.hold()
    assert volts(boards) == OFFSET
    assert not stage.flying


def test_what_was_active_in_a_life_before_is_not_enabled_in_this() -> None:
    stage, boards = active()
    stage.close()
    stage.configure()
    boards.failing = True
    with pytest.raises(StageError):
        stage.activate()
    boards.failing = False
    assert stage.reset()[0]
    assert stage.mode is Mode.READY
    assert not boards.lines.enabled


def test_what_cooled_once_has_not_cooled_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    stage, boards = bridge()
    stage.configure()
    stage.amplifiers.arrays.load[2] = LOAD
    boards.stop_pressed = True
    boards.tick()
    clock.now += stage.parameters.amplifier.thermal_time
    for _ in range(2):
        with pytest.raises(StageError, match='emergency stop'):
            stage.activate()
    assert stage.amplifiers.arrays.load[2] == pytest.approx(LOAD * math.exp(-1.0))


def test_as_hot_as_allowed_is_not_too_hot(monkeypatch: pytest.MonkeyPatch) -> None:
    Clock(monkeypatch)
    stage, _ = bridge()
    stage.configure()
    limit = stage.parameters.amplifier.derate_load
    stage.amplifiers.arrays.load[2] = np.nextafter(limit, 1.0)
    with pytest.raises(StageError, match='hot'):
        stage.activate()
    stage.amplifiers.arrays.load[2] = limit
    stage.activate()
    assert stage.mode is Mode.FOLLOWING


refuse = refusing(DriverError('for a test'))


def test_boards_that_do_not_start_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, boards = bridge()
    stage.configure()
    monkeypatch.setattr(stage.driver, 'start', refuse)
    with pytest.raises(StageError, match='for a test'):
        stage.activate()
    assert stage.mode is Mode.LOST
    assert stage.fault == Fault('board', 'for a test', 'see to the boards', True)
    assert stage.why == 'board'
    assert not boards.cards


@pytest.mark.parametrize('asks', ['home', 'activate'])
def test_boards_that_do_not_tell_their_counts_are_lost(
    monkeypatch: pytest.MonkeyPatch, asks: str
) -> None:
    stage, _ = bridge()
    stage.configure()
    monkeypatch.setattr(stage.driver, 'counts', refuse)
    with pytest.raises(StageError, match='for a test'):
        getattr(stage, asks)()
    assert stage.mode is Mode.LOST
    assert stage.encoders.homed


def test_what_was_watched_in_a_life_before_is_forgotten() -> None:
    stage, _ = active()
    stage.read()
    stage.deactivate()
    assert stage.guard.arrays.samples == 1
    stage.activate()
    assert stage.guard.arrays.samples == 0


def test_boards_that_are_not_disabled_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, _ = active()
    monkeypatch.setattr(stage.driver, 'disable', refuse)
    stage.stop('for another')
    assert stage.mode is Mode.LOST
    assert stage.fault is not None
    assert stage.fault.reason == 'for another; then for a test'  # which came first, first


@pytest.mark.parametrize('after', ['landed', 'reset'])
def test_boards_that_are_not_enabled_again_are_lost(
    monkeypatch: pytest.MonkeyPatch, after: str
) -> None:
    stage, _ = active()
    if after == 'landed':
        stage.land('for a test')
    else:
        stage.stop()
    monkeypatch.setattr(stage.driver, 'enable', refuse)
    if after == 'landed':
        stage.resume()
    else:
        cleared, why = stage.reset()
        assert not cleared
        assert 'for a test' in why
    assert stage.mode is Mode.LOST
    assert stage.fault == Fault('board', 'for a test', 'see to the boards', True)


def test_boards_that_are_lost_while_it_lands_are_the_fault_then() -> None:
    flight = Flight(hover(0.025))
    flight.run(150)
    flight.stage.stop('before')
    assert flight.stage.mode is Mode.LANDING
    flight.boards.expire()
    flight.run(1)
    assert flight.stage.mode is Mode.LOST
    assert flight.stage.fault is not None
    assert (flight.stage.fault.kind, flight.stage.fault.cut) == ('watchdog', True)
    assert flight.stage.why == 'watchdog'
    assert 'strikes the' in flight.stage.fault.reason


def test_boards_that_are_lost_after_a_fault_are_told_after_what_was_found_out_first() -> None:
    stage, boards = active()
    stage.stop('before')
    assert stage.mode is Mode.DISABLED
    lose(stage, boards)
    assert stage.mode is Mode.LOST
    assert stage.fault is not None
    assert stage.fault.reason.startswith('before; then ')


def test_what_is_deactivated_is_remembered_so(tmp_path: Path) -> None:
    """Killed from then on, it has not ended with currents flowing."""
    stage, _ = bridge(boards__memory=str(tmp_path / 'boards.json'))
    stage.configure()
    stage._cooling_since -= 60.0
    stage.activate()
    kept = stage.memory.recall().fault
    assert kept is not None
    assert kept.kind == 'ended'
    stage.deactivate()
    assert stage.memory.recall().fault is None
    stage.close()


def test_it_is_not_reset_while_it_lands_nor_without_a_fault() -> None:
    flight = Flight(hover(0.025))
    flight.run(150)
    assert flight.stage.reset() == (False, 'there is no fault')
    flight.stage.stop()
    assert flight.stage.reset() == (False, 'still landing: reset when the platen rests')
    assert flight.stage.mode is Mode.LANDING


def test_a_reset_says_what_it_cleared_and_begins_to_watch_anew() -> None:
    stage, _ = active()
    for _ in range(5):
        stage.read()
        stage.hold()
    stage.land('for a test')
    assert stage.reset() == (True, 'follows the controller again')
    stage.stop('for another')
    assert stage.guard.arrays.samples == 0
    stage.read()
    stage.hold()
    assert stage.reset() == (True, 'cleared: for another')
    assert stage.guard.arrays.samples == 0


@pytest.mark.parametrize('pushed', [0.0, 1e-4, 1.5e-3])
@pytest.mark.parametrize('back', [(), (0,), (1,)])
def test_a_board_whose_counters_began_anew_has_lost_its_home(
    back: tuple[int, ...], pushed: float
) -> None:
    plugs = {'board': [0, 0, 0, 0, 1, 1], 'channel': [0, 1, 2, 3, 0, 1]}
    wiring = {f'emulation__wiring__encoder_{what}': where for what, where in plugs.items()}
    given = {f'encoder__{what}': where for what, where in plugs.items()}
    stage, boards = active(**given, **wiring, emulation__wiring__encoder_start=[100] * 6)
    its = np.isin(plugs['board'], back)
    lose(stage, boards)
    boards.rig.arrays.start[its] -= boards.rig.counts()[its]
    boards.rig.place(np.array([0.031, pushed, pushed, 0.0, 0.0]))
    boards.tick()
    stage.deactivate()
    assert stage.reset()[0]
    assert stage.encoders.homed == (not back)


def test_boards_that_come_back_to_no_good_are_closed_again() -> None:
    stage, boards = active()
    lose(stage, boards)
    boards.stop_pressed = True
    boards.tick()
    cleared, why = stage.reset()
    assert not cleared
    assert 'emergency stop' in why
    assert stage.mode is Mode.LOST
    assert not boards.cards


@pytest.mark.parametrize('at_rest', [False, True])
def test_boards_that_fail_after_a_fault_do_not_hide_it(at_rest: bool) -> None:
    flight = Flight(hover(0.025))
    flight.run(150)
    flight.stage.stop()
    if at_rest:
        flight.until_no_current()
    else:
        flight.run(50)
    flight.boards.expire()
    flight.run(2)
    stage = flight.stage
    assert stage.mode is Mode.LOST
    assert stage.fault is not None
    assert stage.fault.cut
    assert stage.fault.kind == stage.why if not at_rest else 'watchdog'
    assert stage.fault.reason.startswith('emergency stop; then ')
    assert 'expired' in stage.fault.reason
    assert ('strikes' in stage.fault.reason) != at_rest
    assert stage.fault.remedy.endswith('; see to the boards')
    for _ in range(2):  # and once is enough
        flight.boards.failing = True
        assert not stage.reset()[0]
    assert stage.fault.reason.count('; then ') == 1


def test_boards_lost_in_flight_begin_anew_where_the_platen_is_then() -> None:
    flight = Flight(hover(0.025, 0.005))
    flight.run(150)
    flight.boards.expire()
    flight.run(2)
    assert flight.stage.mode is Mode.LOST
    flight.rig.place(np.array([0.031, 0.005, 0.0, 0.0, 0.0]))
    flight.boards.tick()
    assert flight.stage.reset()[0]
    flight.run(20, controlled=False)
    assert flight.stage.fault is None
    assert flight.stage.mode is Mode.FOLLOWING
