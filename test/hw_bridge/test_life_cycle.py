"""State x call: what every public call does in every mode, and what the outputs then are."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bridge_flight import Flight, hover
from made_up import volts
from wired import OFFSET, bridge

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage, Mode
from maglev_model.contract.stage import StageError
from maglev_model.parameters import ParameterError, build

LOWER_STOP, UPPER_STOP = 0.031, 0.018
CALLS = (
    'configure', 'home', 'activate', 'read', 'write', 'hold', 'land', 'stop', 'reset', 'resume',
    'deactivate', 'close',
)  # fmt: skip


def in_mode(mode: Mode) -> tuple[BridgeStage, EmulatedBoards]:
    """A bridge in that mode; LANDING in the air, DISABLED and LOST with a fault."""
    stage, boards = bridge()
    if mode is Mode.CLOSED:
        return stage, boards
    stage.configure()
    if mode is Mode.READY:
        return stage, boards
    stage.activate()
    if mode is Mode.FOLLOWING:
        return stage, boards
    if mode is Mode.LANDING:
        boards.rig.place(np.array([0.025, 0.0, 0.0, 0.0, 0.0]))
        stage.guard.forget()
        for _ in range(3):
            stage.read()
            stage.write(np.full(4, 0.6), np.zeros(4))
        stage.stop()
        assert stage.mode is Mode.LANDING
        return stage, boards
    if mode is Mode.DISABLED:
        stage.stop()
        assert stage.mode is Mode.DISABLED
        return stage, boards
    boards.failing = True
    with pytest.raises(StageError):
        stage.read()
    boards.failing = False
    return stage, boards


def call(stage: BridgeStage, name: str) -> Any:
    arguments = {'write': (np.zeros(4), np.zeros(4)), 'land': ('for a test',)}.get(name, ())
    return getattr(stage, name)(*arguments)


def no_current(boards: EmulatedBoards) -> bool:
    expired = not boards.lines.enabled and not np.any(boards.volts)
    return volts(boards) == OFFSET or expired


# The mode after a call, or the error it raises, by the mode before it.
REFUSED = (StageError, HomingError)
TABLE: dict[Mode, dict[str, Mode | tuple[type[Exception], ...]]] = {
    Mode.CLOSED: {'configure': Mode.READY, 'home': REFUSED, 'activate': REFUSED, 'read': REFUSED},
    Mode.READY: {'configure': REFUSED, 'activate': Mode.FOLLOWING, 'read': REFUSED},
    Mode.FOLLOWING: {
        'configure': REFUSED, 'home': REFUSED, 'activate': REFUSED, 'land': Mode.DISABLED,
        'stop': Mode.DISABLED, 'deactivate': Mode.READY,
    },
    Mode.LANDING: {
        'configure': REFUSED, 'home': REFUSED, 'activate': REFUSED, 'deactivate': Mode.READY,
    },
    Mode.DISABLED: {
        'configure': REFUSED, 'home': REFUSED, 'activate': REFUSED, 'reset': Mode.FOLLOWING,
        'deactivate': Mode.READY,
    },
    Mode.LOST: {
        'configure': REFUSED, 'home': REFUSED, 'activate': REFUSED, 'read': REFUSED,
        'reset': Mode.FOLLOWING,
    },
}  # fmt: skip


@pytest.mark.parametrize('name', CALLS)
@pytest.mark.parametrize('mode', list(Mode))
def test_every_call_in_every_mode(mode: Mode, name: str) -> None:
    stage, boards = in_mode(mode)
    expected = Mode.CLOSED if name == 'close' else TABLE[mode].get(name, mode)
    if isinstance(expected, Mode):
        call(stage, name)
        assert stage.mode is expected
    else:
        with pytest.raises(expected):
            call(stage, name)
        assert stage.mode is mode
    assert boards.lines.enabled == (stage.mode in (Mode.FOLLOWING, Mode.LANDING))
    if stage.mode is not Mode.LANDING and stage.mode is not mode:
        assert no_current(boards)
    stage.close()
    assert no_current(boards)
    assert not boards.lines.enabled
    assert not boards.cards


@pytest.mark.parametrize('mode', list(Mode))
def test_a_restart_works_from_every_mode(mode: Mode) -> None:
    stage, boards = in_mode(mode)
    stage.close()
    boards.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    again = BridgeStage(stage.parameters, driver=stage.driver)
    again.configure()
    again.activate()
    again.read()
    again.close()


@pytest.mark.parametrize('mode', [Mode.FOLLOWING, Mode.LANDING, Mode.DISABLED])
def test_boards_that_fail_while_they_are_deactivated_are_a_fault(mode: Mode) -> None:
    stage, boards = in_mode(mode)
    boards.failing = True
    stage.deactivate()
    assert stage.mode is Mode.LOST
    assert stage.fault is not None
    assert no_current(boards)  # the watchdog has seen to that
    assert not boards.lines.enabled
    boards.failing = False
    for card in list(boards.cards.values()):
        card.close()
    boards.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    cleared, _ = stage.reset()
    assert cleared
    assert stage.mode is Mode.READY  # an inactive stage is not enabled by a reset
    assert not boards.lines.enabled
    stage.activate()
    assert boards.lines.enabled


def test_lost_boards_of_a_stage_that_was_deactivated_since_are_not_enabled() -> None:
    stage, boards = in_mode(Mode.LOST)
    stage.deactivate()
    assert stage.reset()[0]
    assert stage.mode is Mode.READY
    assert not boards.lines.enabled


def unhome(stage: BridgeStage, _boards: EmulatedBoards) -> None:
    stage.encoders.homed = False


def press(_stage: BridgeStage, boards: EmulatedBoards) -> None:
    boards.stop_pressed = True


def heat(stage: BridgeStage, _boards: EmulatedBoards) -> None:
    stage.amplifiers.arrays.load[11] = 50.0


def shift_x(_stage: BridgeStage, boards: EmulatedBoards) -> None:
    boards.jumps[4] += 5_200  # 52 mm


AGAINST: list[tuple[Callable[[BridgeStage, EmulatedBoards], None], str]] = [
    (unhome, 'home first'),
    (press, 'emergency stop is pressed'),
    (heat, 'hot'),
    (shift_x, 'encoder x reads'),
]


@pytest.mark.parametrize(('spoil', 'text'), AGAINST)
def test_what_speaks_against_activation(
    spoil: Callable[[BridgeStage, EmulatedBoards], None], text: str
) -> None:
    stage, boards = in_mode(Mode.READY)
    spoil(stage, boards)
    boards.tick()
    with pytest.raises(StageError, match=text):
        stage.activate()
    assert stage.mode is Mode.READY
    assert not boards.lines.enabled


# That x is beyond its stop is known first where nobody samples, that it leapt where somebody does.
@pytest.mark.parametrize(('spoil', 'text'), [*AGAINST[1:-1], (shift_x, 'home')])
@pytest.mark.parametrize('mode', [Mode.DISABLED, Mode.LOST])
def test_what_speaks_against_a_reset(
    mode: Mode, spoil: Callable[[BridgeStage, EmulatedBoards], None], text: str
) -> None:
    stage, boards = in_mode(mode)
    spoil(stage, boards)
    if mode is Mode.DISABLED:
        stage.read()
        stage.hold()
    else:
        boards.tick()
    cleared, why = stage.reset()
    assert not cleared
    assert text in why
    assert stage.mode is mode
    assert not boards.lines.enabled


def test_counters_that_came_back_as_0_are_not_homed() -> None:
    stage, boards = in_mode(Mode.FOLLOWING)
    boards.rig.place(np.array([0.0305, 0.01, 0.0, 0.0, 0.0]))
    boards.failing = True
    with pytest.raises(StageError):
        stage.read()
    boards.failing = False
    stage.encoders.arrays.total[:] = 7  # it counted before
    boards.counters[:] = 0
    boards.rig.arrays.start[:] -= boards.rig.counts()
    cleared, why = stage.reset()
    assert not cleared
    assert 'home first' in why
    assert stage.mode is Mode.LOST
    stage.deactivate()
    assert stage.reset()[0]
    with pytest.raises(StageError, match='home first'):
        stage.activate()


def test_unhomed_stays_unhomed_when_boards_come_back() -> None:
    stage, _ = in_mode(Mode.LOST)
    stage.deactivate()
    stage.encoders.homed = False
    assert stage.reset()[0]
    assert not stage.encoders.homed


def test_a_reset_in_flight_where_nothing_is_latched_is_refused_and_changes_nothing() -> None:
    plain, asked = Flight(hover(0.025)), Flight(hover(0.025))
    for flight in (plain, asked):
        flight.regulator.reset()
        flight.run(150)
        if flight is asked:
            assert flight.stage.reset() == (False, 'there is no fault')
        flight.run(50)
        assert flight.stage.mode is Mode.FOLLOWING
    assert np.array_equal(asked.rig.state, plain.rig.state)


@pytest.mark.parametrize('recover', ['reset', 'restart', 'deactivate'])
def test_a_second_fault_after_every_recovery(recover: str) -> None:
    """What was done about the first one leaves nothing behind that spoils the second."""
    start = {'emulation.wiring.encoder_start': [100] * 6}
    flight = Flight(hover(0.025), {'boards.enable_output': 1, **start})
    for encoder in (1, 2):
        flight.run(150)
        assert flight.stage.mode is Mode.FOLLOWING, flight.stage.fault
        flight.rig.forget_impact()
        if recover == 'restart':
            flight.boards.expire()
            flight.run(1)
            assert flight.stage.mode is Mode.LOST
        else:
            flight.stage.stop()
            flight.until_no_current()
            assert flight.rig.impact < 0.05, encoder
            if recover == 'deactivate':
                flight.stage.deactivate()
        assert not flight.boards.lines.enabled
        flight.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
        cleared, why = flight.stage.reset()
        assert cleared, why
        if recover == 'deactivate':
            flight.stage.activate()
        flight.rig.place(flight.target(0.0)[0])
        flight.stage.guard.forget()
        flight.regulator.reset()


@pytest.mark.parametrize('first', ['stop', 'encoder', 'lost'])
def test_a_stop_while_a_fault_is_latched_outlasts_the_reset_that_was_under_way(first: str) -> None:
    flight = Flight(hover(0.025))
    flight.run(150)
    if first == 'stop':
        flight.stage.stop()
    elif first == 'encoder':
        flight.boards.jumps[4] = 300
    else:
        flight.boards.expire()
    flight.run(1)
    if first != 'lost':
        flight.until_no_current()
    flight.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    flight.boards.jumps[:] = 0
    latched, mode = flight.stage.fault, flight.stage.mode
    assert latched is not None
    flight.stage.stop('by the other one')
    refused, why = flight.stage.reset()
    assert not refused
    assert 'by the other one' in why
    assert flight.stage.fault == latched
    assert flight.stage.mode is mode
    assert 'by the other one' not in flight.stage.reset()[1]


@pytest.mark.parametrize('stage_kind', ['lower', 'upper', 'held'])
def test_homing_tells_the_stops_apart(stage_kind: str) -> None:
    stage, boards = bridge(homing__at_start=False)
    place = {'upper': UPPER_STOP}.get(stage_kind, LOWER_STOP)
    boards.rig.place(np.array([place, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(50):
        boards.tick()
    assert boards.rig.state[0] == pytest.approx(place, abs=1e-5)  # the magnets hold it there
    stage.configure()
    if stage_kind == 'held':
        for phase in range(12):
            boards.dead(phase)
    if stage_kind == 'lower':
        stage.home()
        assert stage.encoders.homed
        stage.activate()
    else:
        with pytest.raises(HomingError, match='put it on the lower one'):
            stage.home()
        assert not stage.encoders.homed
        with pytest.raises(StageError):
            stage.activate()
    assert boards.rig.impact < 0.05
    stage.close()


@pytest.mark.parametrize('magnets', [1.0, 1.1])
@pytest.mark.parametrize('seen', [(), (3,), (4, 5)])
def test_homing_with_encoders_that_are_not_plugged_in_throws_nothing_up(
    seen: tuple[int, ...], magnets: float
) -> None:
    """``magnets`` is how much stronger they are than believed."""
    offset = {f'emulation__offset__{name}': magnets for name in ('K_v1', 'K_v2', 'K_v3')}
    stage, boards = bridge(homing__at_start=False, **offset)
    boards.rig.place(np.array([LOWER_STOP, 0.0, 0.0, 0.0, 0.0]))
    boards.stuck[:] = [encoder not in seen for encoder in range(6)]
    stage.configure()
    highest = LOWER_STOP

    def watch(tick=boards.tick) -> None:
        nonlocal highest
        tick()
        highest = min(highest, float(boards.rig.state[0]))

    boards.tick = watch
    with pytest.raises(HomingError):
        stage.home()
    assert boards.rig.impact < 0.1
    assert LOWER_STOP - highest < 2e-3
    stage.close()


def test_homing_by_word_only() -> None:
    stage, boards = bridge(homing__at_start=False, homing__lift=0.0)
    stage.configure()
    ticks = boards.ticks
    stage.home()
    assert boards.ticks == ticks
    assert stage.encoders.homed


def test_real_boards_are_not_homed_at_the_start() -> None:
    real = build(BridgeParameters, {'driver': 'quanser', 'homing.at_start': True})
    driver = bridge()[0].driver
    with pytest.raises(ParameterError, match=r'homing\.at_start.*lower stop'):
        BridgeStage(real, driver=driver)


def test_a_cut_is_put_out_before_it_is_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    flight = Flight(hover(0.025), {'boards.enable_output': 1})
    flight.run(150)
    seen = []

    def explain(*_: object) -> str:
        seen.append((np.any(flight.boards.volts), flight.boards.lines.enabled))
        return ''

    monkeypatch.setattr('maglev_hw_bridge.faults.consequence_of_cut', explain)
    flight.stage._raise_fault('encoder', 'for a test', 'nothing', cut=True)
    assert seen == [(False, False)]
