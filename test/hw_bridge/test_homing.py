"""Homing: what forbids it, what it does, and what it says where it fails."""

from __future__ import annotations

import re

import numpy as np
import pytest
from bridge_flight import Flight, hover
from made_up import LOWER_STOP, Clock, refusing
from wired import bridge

from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import Fault, StageError
from maglev_model.parameters import ParameterError, build


def test_no_home_at_the_start_is_no_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    stage, boards = bridge()
    monkeypatch.setattr(stage.encoders, 'home', refusing(HomingError('for a test')))
    with pytest.raises(StageError, match='homing refused: for a test'):
        stage.configure()
    assert stage.mode is Mode.CLOSED
    assert not boards.cards


@pytest.mark.parametrize(
    ('kind', 'homes'), [('encoder', True), ('board', False), ('current', False)]
)
def test_only_with_a_fault_that_homing_mends_the_platen_is_lifted(kind: str, homes: bool) -> None:
    stage, _ = bridge(homing__at_start=False)
    stage.configure()
    stage.fault = latched = Fault(kind, 'for a test', 'none', False)
    if homes:
        stage.home()
    else:
        with pytest.raises(HomingError, match='a fault is latched: for a test'):
            stage.home()
    assert stage.encoders.homed == homes
    assert stage.fault is latched  # until it is reset
    assert stage.mode is Mode.READY


@pytest.mark.parametrize('when', ['in the landing', 'at rest', 'inactive'])
def test_what_loses_counts_while_another_fault_is_latched_is_homed_after_its_reset(
    when: str,
) -> None:
    flight = Flight(hover(0.025), {'boards.enable_output': 1})
    flight.run(150)
    flight.stage.stop()
    if when == 'in the landing':
        flight.run(100, controlled=False)
        flight.boards.jumps[0] += 200
    flight.until_no_current()
    if when == 'at rest':
        flight.boards.jumps[0] += 200
        flight.run(3)
    if when != 'inactive':
        cleared, why = flight.stage.reset()
        assert not cleared
        assert why.endswith('encoder gap 1 lost counts: home again')
    flight.stage.deactivate()
    if when == 'inactive':
        flight.boards.jumps[0] += 200
        flight.boards.tick()
    with pytest.raises(HomingError, match='a fault is latched: emergency stop'):
        flight.stage.home()
    assert flight.stage.reset()[0]
    assert not flight.boards.lines.enabled
    with pytest.raises(StageError, match='not homed'):
        flight.stage.activate()
    flight.stage.home()
    flight.stage.activate()
    assert flight.boards.lines.enabled
    assert flight.stage.read().gap == pytest.approx([LOWER_STOP] * 4)


def test_no_platen_is_lifted_for_an_encoder_where_a_stop_since_was_not_reset() -> None:
    stage, boards = bridge(homing__at_start=False, boards__enable_output=1)
    stage.configure()
    stage.fault = Fault('encoder', 'for a test', 'none', False)
    stage.stop('by somebody else')
    with pytest.raises(HomingError, match='stopped since the fault: by somebody else'):
        stage.home()
    assert boards.ticks == 0
    assert 'by somebody else' in stage.reset()[1]
    stage.home()
    assert stage.reset() == (True, 'cleared: for a test')


def test_with_a_fault_latched_it_is_homed_by_word_all_the_same() -> None:
    stage, _ = bridge(homing__at_start=False)
    stage.configure()
    stage.fault = Fault('board', 'for a test', 'none', False)
    stage.home(vouched=True)
    assert stage.encoders.homed


def test_once_homed_every_encoder_is_believed() -> None:
    stage, _ = bridge(homing__at_start=False)
    stage.configure()
    stage.guard.lose(4)
    stage.home(vouched=True)
    assert stage.guard.failed == []


@pytest.mark.parametrize('realtime', [True, False])
def test_between_readings_of_home_real_boards_are_given_time(
    monkeypatch: pytest.MonkeyPatch, realtime: bool
) -> None:
    stage, _ = bridge(homing__at_start=False)
    clock = Clock(monkeypatch)
    stage.realtime = realtime
    stage.configure()
    stage.home(vouched=True)
    samples = stage.parameters.homing.samples if realtime else 0
    assert clock.slept == [stage.sample_time] * samples


def test_encoders_that_did_not_count_in_the_lift_are_named() -> None:
    stage, boards = bridge(homing__at_start=False)
    for phase in range(12):
        boards.dead(phase)
    stage.configure()
    names = 'gap 1, gap 2, gap 3, gap 4'
    with pytest.raises(HomingError, match=rf'mrad; encoder {names} did not count\. It hangs'):
        stage.home()
    assert stage.fault is None


@pytest.mark.parametrize('volts', [-4.5, 4.5])
@pytest.mark.parametrize('phase', [0, 3, 8])
def test_an_amplifier_that_is_stuck_on_lifts_no_corner_by_a_millimetre(
    phase: int, volts: float
) -> None:
    """Not landed: while that goes on, the amplifier pulls it up. Or so fast as if counts leapt."""
    stage, boards = bridge(homing__at_start=False)
    outputs, gaps = boards.outputs, []

    def stuck() -> np.ndarray:
        gaps.append(stage.guard.arrays.length[:4].min())
        return np.where(np.arange(12) == phase, volts, outputs())

    boards.outputs = stuck
    stage.configure()
    told = r'mrad: (the platen tilted by 0\.\d\d mrad in the lift|encoder gap \d jumped)'
    with pytest.raises(HomingError, match=told):
        stage.home()
    assert stage.fault is not None
    assert not boards.lines.enabled
    assert min(gaps) > stage.parameters.machine.gap_max - 1e-3


def test_a_fault_of_the_lift_is_told_and_stays() -> None:
    stage, boards = bridge(homing__at_start=False)
    stage.configure()
    tick = boards.tick

    def press() -> None:
        tick()
        boards.stop_pressed = boards.ticks > 60

    boards.tick = press
    with pytest.raises(HomingError, match=r'mrad: the emergency stop is pressed\. It hangs'):
        stage.home()
    assert stage.fault is not None
    assert stage.fault.kind == 'stop'
    assert not stage.encoders.homed


def test_at_the_ends_of_its_guides_it_is_homed_and_flown_only_away_from_them() -> None:
    stage, boards = bridge(homing__at_start=False, homing__x=-0.05, homing__z=-0.05)
    boards.rig.place(np.array([0.031, -0.05, -0.05, 0.0, 0.0]))
    boards.tick()
    stage.configure()
    stage.home()
    assert stage.encoders.homed
    assert stage.fault is None
    stage.activate()
    for _ in range(3):
        stage.read()
        stage.write(np.full(4, 0.1), np.zeros(4))
    assert stage.fault is not None
    assert re.fullmatch(r'x is -(48|49|50)\.\d+ mm, outside its soft range', stage.fault.reason)


def test_what_keeps_it_from_a_lift_is_all_that_is_said() -> None:
    stage, boards = bridge(homing__at_start=False)
    stage.configure()
    boards.stop_pressed = True
    boards.tick()
    with pytest.raises(HomingError, match=r'^the platen cannot be lifted: the emergency stop is p'):
        stage.home()
    assert not stage.encoders.homed
    assert stage.fault is None


@pytest.mark.parametrize(
    ('given', 'name'),
    [
        ({'homing.x': 0.0506}, r'homing\.x.*0\.0506 m, beyond the stops'),
        ({'homing.z': -0.0406, 'machine.z_max': 0.04}, r'homing\.z.*-0\.0406 m, beyond the stops'),
        ({'machine.gap_max': 0.033, 'homing.x': 0.0}, r'fault\.gap_upper.*0\.032 m.*rests at'),
    ],
)
def test_a_home_where_no_platen_rests_is_refused(given: dict[str, float], name: str) -> None:
    with pytest.raises(ParameterError, match=name):
        BridgeStage(build(BridgeParameters, given))


def test_a_home_at_the_stops_may_be_beyond_them_within_tolerances() -> None:
    build(BridgeParameters, {'homing.x': 0.0505, 'homing.z': -0.0505}).check_homing()
