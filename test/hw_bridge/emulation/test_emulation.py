"""The emulated boards behave like boards, and the machine behind them like the machine."""

from __future__ import annotations

import time

import numpy as np
import pytest
from bridge_flight import HOME

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.emulation.card import HILError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import ParameterError, build

EIGHT = np.arange(8, dtype=np.uint32)


def boards(realtime: bool = False, **overrides: object) -> EmulatedBoards:
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    return EmulatedBoards(build(BridgeParameters, {**HOME, **names}), realtime)


def test_a_wrong_type_is_silently_something_else() -> None:
    world = boards(emulation__wiring__encoder_start=[7, 8, 9, 10, 11, 12])
    card = world.HIL('q8', '0')
    counts = np.zeros(6, dtype=np.int32)
    card.read_encoder(EIGHT[:6], 6, counts)
    assert counts.tolist() == [7, 8, 9, 10, 11, 12]
    card.read_encoder(np.arange(6, dtype=np.int64), 6, counts)  # 0, 0, 1, 0, 2, 0 as uint32
    assert counts.tolist() == [7, 7, 8, 7, 9, 7]
    wrong = np.zeros(6, dtype=np.int64)
    card.read_encoder(EIGHT[:6], 6, wrong)
    assert wrong[0] == 7 + (8 << 32)


@pytest.mark.parametrize('board', ['2', 'x'])
def test_a_board_that_is_not_there(board: str) -> None:
    with pytest.raises(HILError, match='no board'):
        boards().HIL('q8', board)


def test_a_board_in_use_a_closed_board_and_a_wrong_channel() -> None:
    world = boards()
    card = world.HIL('q8', '0')
    with pytest.raises(HILError, match='in use'):
        world.HIL('q8', '0')
    with pytest.raises(HILError, match='channel 8'):
        card.write_analog(np.array([8], dtype=np.uint32), 1, np.zeros(1))
    card.close()
    with pytest.raises(HILError, match='closed') as caught:
        card.read_encoder(EIGHT, 8, np.zeros(8, dtype=np.int32))
    assert caught.value.error_code < 0
    world.HIL('q8', '0').close()


def test_expiry_without_a_state_leaves_the_outputs_as_they_are() -> None:
    card = (world := boards()).HIL('q8', '0')
    card.write_analog(EIGHT, 8, np.ones(8))
    card.watchdog_start(0.005)
    for _ in range(6):
        world.tick()
    assert card.watchdog_is_expired()
    assert not card.watchdog_reload()
    assert np.all(world.volts[0] == 1.0)
    with pytest.raises(HILError, match='expired'):
        card.write_analog(EIGHT, 8, np.zeros(8))
    card.watchdog_clear()
    card.write_analog(EIGHT, 8, np.zeros(8))


def test_samples_wait_in_the_buffer_until_it_is_full() -> None:
    world = boards(boards__buffer=4)
    card = world.HIL('q8', '0')
    task = card.task_create_encoder_reader(4, EIGHT, 8)
    card.task_start(task, world.Clock.HARDWARE_CLOCK_0, 1000.0, world.HIL.INFINITE)
    counts = np.zeros(8, dtype=np.int32)
    for _ in range(4):
        world.tick()
    for _ in range(4):
        card.task_read_encoder(task, 1, counts)
    assert world.ticks == 4
    card.task_read_encoder(task, 1, counts)
    assert world.ticks == 5
    for _ in range(5):
        world.tick()
    with pytest.raises(HILError, match='buffer was full'):
        card.task_read_encoder(task, 1, counts)


def test_real_time_is_paced_by_the_clock() -> None:
    world = boards(realtime=True)
    driver = QuanserDriver(world.parameters, world, world.now)
    driver.open()
    start = time.monotonic()  # of the boards' clock; a reading that comes late is made up for
    driver.start()
    counts, zero = np.zeros(6, dtype=np.int32), np.zeros(12)
    driver.read(counts)
    for _ in range(50):
        driver.write(zero)
        driver.read(counts)
    assert time.monotonic() - start > 0.045
    driver.close()


@pytest.mark.parametrize(('patience', 'passed'), [(0.04, 10), (0.0, 100)])
def test_patient_boards_stand_still_while_the_bridge_is_stopped(
    patience: float, passed: int
) -> None:
    now = 0.0
    parameters = build(BridgeParameters, {**HOME, 'emulation.patience': patience})
    world = EmulatedBoards(parameters, True, lambda: now)
    for expected in (passed, 2 * passed):
        now += 0.1001
        assert world.now() == pytest.approx(1e-3 * expected, abs=1e-3)  # who asks first is told
        assert world.ticks == expected
    world.delay(0)
    now += 0.003
    world.catch_up()
    assert world.ticks == 2 * passed + 3


def test_currents_rise_no_faster_than_the_supply_lets_them() -> None:
    world = boards(emulation__winding__inductance=0.05, emulation__guide__locked=[True] * 5)
    world.volts[0, 0] = 7.0
    currents = []
    for _ in range(30):
        world.tick()
        currents.append(float(world.rig.phase_current[0]))
    resistance, inductance, time_ = 2.0, 0.05, 1e-3 * np.arange(1, 31)
    free = 28.0 / resistance * (1.0 - np.exp(-resistance / inductance * time_))
    assert currents == pytest.approx(np.minimum(free, 7.0), abs=1e-3)
    assert world.rig.phase_current[1:] == pytest.approx(np.zeros(11))


def test_counters_start_anywhere_and_roll_over() -> None:
    top = 2**31 - 3
    world = boards(emulation__wiring__encoder_start=[top] * 6)
    card = world.HIL('q8', '0')
    world.rig.place(np.array([0.0305, 0.01, -0.02, 0.0, 0.0]))
    world.tick()
    counts = np.zeros(6, dtype=np.int32)
    card.read_encoder(EIGHT[:6], 6, counts)
    moved = (counts.astype(np.int64) - top + 2**31) % 2**32 - 2**31
    assert moved.tolist() == [-50, -50, -50, -50, 1000, -2000]


def test_boards_count() -> None:
    with pytest.raises(ParameterError, match='boards count'):
        boards(emulation__encoder__gap_resolution=0.0)


def test_the_same_run_twice_is_the_same() -> None:
    ends = []
    for _ in range(2):
        world = boards(emulation__encoder__gap_noise=1e-5)
        for k in range(300):
            world.volts[:, :6] = np.sin(0.1 * k)
            world.tick()
        ends.append((world.rig.state.tolist(), world.counters.tolist()))
    assert ends[0] == ends[1]
