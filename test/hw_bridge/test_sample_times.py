"""The bridge with other samples than those of a millisecond; nothing flies."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import LOWER_STOP, Calls, active, aloft, watched

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.sensing import guard
from maglev_hw_bridge.stage import Mode
from maglev_model.parameters import build

UP, ZERO = np.full(4, 0.1), np.zeros(4)


@pytest.mark.parametrize(
    ('period', 'age'), [(2.5e-4, 20), (5e-4, 10), (1e-3, 5), (1.25e-3, 4), (1.5e-3, 4), (2e-3, 3)]
)
def test_currents_are_stale_when_they_are_5_ms_old_and_no_sooner(period: float, age: int) -> None:
    for old in (age - 1, age):
        stage, _ = active(sample_time=period)
        aloft(stage)
        stage.flying = True
        stage.write(UP, ZERO, old)
        assert (stage.fault is not None) == (old == age)


@pytest.mark.parametrize('count', [1e-5, 2e-5])
@pytest.mark.parametrize('period', [1e-4, 2.5e-4])
def test_what_slides_by_single_counts_has_not_leapt(period: float, count: float) -> None:
    stage, _ = active(sample_time=period, encoder__resolution=(1e-5,) * 4 + (count,) * 2)
    watched(stage, LOWER_STOP)
    stage.guard.arrays.samples = 10
    for _ in range(round(0.12 / period)):
        stage._slides()
    found = []
    for k in range(1, round(4e-4 / count)):
        stage.guard.arrays.position[1] = count * k
        found.append(stage._slides())
    assert any(found)


@pytest.mark.parametrize('period', [1e-4, 2.5e-4, 1e-3, 2e-3])
def test_no_sample_is_lost_before_the_watchdog_expires(period: float) -> None:
    parameters = build(BridgeParameters, {'sample_time': period})
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    driver.open()
    driver.start()
    late = round(0.016 / period)
    boards.delay(late)
    counts = np.zeros(6, np.int32)
    for _ in range(1 + late):
        driver.read(counts)
        driver.write(np.zeros(12))
    assert driver.late < period


@pytest.mark.parametrize('period', [2.5e-4, 1e-3, 1.25e-3, 2e-3, 1e-2])
def test_boards_that_are_slept_for_have_their_time(period: float) -> None:
    """A quarter of the watchdog's is half a sample of 100 Hz."""
    slow = {'fault.stale': 0.02, 'boards.watchdog': 0.02}
    boards = EmulatedBoards(build(BridgeParameters, {'sample_time': period, **slow}))
    boards.sleep(0.25 * 0.02)
    assert boards.now() >= 0.25 * 0.02 - 1e-9


def test_a_bridge_that_is_15_ms_late_lands() -> None:
    stage, boards = active(sample_time=2.5e-4)
    stage.read()
    aloft(stage)
    stage.guard.watch = Calls((guard.FINE, 0))
    stage.write(UP, ZERO)
    boards.delay(60)
    stage.read()
    assert stage.fault is not None
    assert stage.fault.kind == 'overrun'
    assert stage.mode is Mode.LANDING
