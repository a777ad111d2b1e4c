"""An encoder that leaps while the boards start, or right after a reset, is never flown with."""

from __future__ import annotations

import numpy as np
import pytest
from wired import bridge

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.sensing.guard_arrays import LOST, SOUND
from maglev_hw_bridge.signal_parameters import ENCODER_NAMES
from maglev_hw_bridge.stage import BridgeStage, Mode


def started() -> tuple[BridgeStage, EmulatedBoards]:
    """Homed and active, before its first sample."""
    stage, boards = bridge()
    stage.configure()
    stage.activate()
    return stage, boards


def sampled(stage: BridgeStage) -> None:
    for _ in range(3):
        stage.read()
        stage.hold()


def leap(stage: BridgeStage, boards: EmulatedBoards, encoder: int, way: float) -> None:
    boards.jumps[encoder] += round(way / stage.parameters.encoder.resolution[encoder])
    boards._count()


@pytest.mark.parametrize('encoder', range(6))
@pytest.mark.parametrize('way', [-0.04, -3e-4, 3e-4])
def test_before_the_first_sample_it_is_lost(encoder: int, way: float) -> None:
    stage, boards = started()
    leap(stage, boards, encoder, way)
    sampled(stage)
    assert stage.mode is Mode.DISABLED
    assert stage.fault is not None
    assert f'encoder {ENCODER_NAMES[encoder]} ' in stage.fault.reason
    trust = stage.guard.arrays.trust
    assert trust[encoder] == LOST
    assert np.count_nonzero(trust != SOUND) == 1
    assert not stage.reset()[0], 'before it is homed'
    stage.close()


@pytest.mark.parametrize('encoder', range(6))
def test_what_bends_or_vibrates_is_not(encoder: int) -> None:
    stage, boards = started()
    leap(stage, boards, encoder, 2e-4)
    sampled(stage)
    assert stage.mode is Mode.FOLLOWING
    assert not np.any(stage.guard.arrays.trust)
    stage.close()


def test_in_the_sample_of_a_reset_it_is_lost() -> None:
    stage, boards = started()
    sampled(stage)
    stage.stop('for a test', 'command')
    sampled(stage)
    assert stage.reset()[0]
    leap(stage, boards, 4, 0.03)
    sampled(stage)
    assert stage.mode is Mode.DISABLED
    assert stage.guard.arrays.trust[4] == LOST
    stage.close()


def test_where_it_was_pushed_to_while_inactive_is_where_it_is() -> None:
    stage, boards = started()
    sampled(stage)
    stage.deactivate()
    leap(stage, boards, 5, 0.02)
    stage.activate()
    sampled(stage)
    assert stage.mode is Mode.FOLLOWING
    assert stage.guard.arrays.position[2] == pytest.approx(0.02, abs=1e-5)
    stage.close()
