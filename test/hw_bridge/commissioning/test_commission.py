"""Commissioning finds a single wrong sign or exchanged pair, and says what to change."""

from __future__ import annotations

import _thread
import ctypes
import json
import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from bridge_flight import HOME

from maglev_hw_bridge.commissioning.commission import Commissioning, _ended_by_signals, run
from maglev_hw_bridge.commissioning.operators import EmulatedPerson, StoppedError
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.memory import Memory
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.contract.stage import Fault
from maglev_model.parameters import build
from maglev_node import realtime

DEFAULT = BridgeParameters()
PEAK = 1.5
LINES = {'boards.stop_input': 0, 'boards.enable_output': 1}
OTHER_MACHINE = {
    'emulation.guide.coulomb': [0.4, 0.22, 0.12, 1.6, 1.1],
    'emulation.offset.K_h': 0.95,
    'emulation.wiring.encoder_start': [100, -5000, 7, 2**31 - 5, 0, 3],
}
PARAMS = Path(__file__).resolve().parents[3] / 'params' / 'hw_bridge.yaml'


def flipped(values: Sequence[int], index: int) -> list[int]:
    return [-value if i == index else value for i, value in enumerate(values)]


def exchanged(values: Sequence[int], one: int, two: int) -> list[int]:
    result = list(values)
    result[one], result[two] = result[two], result[one]
    return result


def commission(
    claimed: dict[str, object],
    asked: Callable[[EmulatedBoards, str], None] | None = None,
    signals: Sequence[int] = (),
) -> tuple[list[str], EmulatedBoards]:
    """Commission a machine that is wired as by default, with what the parameters claim.

    ``asked`` is called with each question.
    """
    parameters = build(BridgeParameters, {**HOME, **claimed})
    boards = EmulatedBoards(build(BridgeParameters, {**HOME, **claimed, **OTHER_MACHINE}))
    told: list[str] = []
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)

    def go_on(step: str) -> None:
        told.append(step)
        if asked is not None:
            asked(boards, step)

    operator = EmulatedPerson(boards, go_on)
    steps = Commissioning(
        parameters,
        driver,
        peak=PEAK,
        operator=operator,
        tell=told.append,
        priority=40,
        signals=signals,
    )
    try:
        steps.run()
    finally:
        assert not np.any(boards.volts)
        assert not boards.cards
        assert boards.lines.enabled == (parameters.boards.enable_output < 0)
    return told, boards


def test_a_machine_that_is_right() -> None:
    told, boards = commission({})
    assert 'as the parameters say' in ''.join(told)
    assert any(f'rose 0.{height}' in told[-1] for height in (49, 50, 51))
    assert boards.rig.state[0] == 0.031
    assert boards.rig.impact < 0.05


def test_the_first_lift_off_of_real_boards_is_on_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[object] = []
    monkeypatch.setattr(realtime, 'take', lambda priority: order.append(priority) or ['a thing'])
    monkeypatch.setattr(realtime, 'give_priority_back', lambda: order.append('given back'))

    def asked(boards: EmulatedBoards, step: str) -> None:
        if not step.startswith('first lift-off'):
            return
        tick = boards.tick

        def flying() -> None:
            tick()
            if boards.rig.state[0] < 0.0307 and order[-1] != 'flies':
                order.append('flies')

        boards.tick = flying  # type: ignore[method-assign]

    real = {'driver': 'quanser', 'homing.at_start': False, 'boards.memory': str(tmp_path / 'it')}
    told, _ = commission(real, asked)
    assert order == [40, 'flies', 'given back']
    assert '  not permitted: a thing: samples may come late' in told
    order.clear()
    commission({})
    assert not order


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTSTP, signal.SIGQUIT])
def test_no_signal_ends_the_lift_off_in_the_air(number: signal.Signals) -> None:
    seen: list[EmulatedBoards] = []

    def asked(boards: EmulatedBoards, step: str) -> None:
        if not step.startswith('first lift-off'):
            return
        seen.append(boards)
        tick = boards.tick

        def signalled() -> None:
            tick()
            if boards.rig.state[0] < 0.0307:
                _thread.interrupt_main(number)

        boards.tick = signalled  # type: ignore[method-assign]

    with _ended_by_signals(), pytest.raises(KeyboardInterrupt):
        commission({}, asked)
    assert seen[0].rig.state[0] == 0.031
    assert seen[0].rig.impact < 0.05


@pytest.mark.parametrize('step', ['prove', 'motor 1'])
@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP, signal.SIGQUIT])
def test_a_signal_ends_it_where_current_flows(number: signal.Signals, step: str) -> None:
    told: list[str] = []

    def asked(boards: EmulatedBoards, question: str) -> None:
        told.append(question)
        tick = boards.tick

        def signalled() -> None:
            tick()
            if question.startswith(step) and np.max(np.abs(boards.rig.phase_current)) > 0.4:
                _thread.interrupt_main(number)

        boards.tick = signalled  # type: ignore[method-assign]

    with _ended_by_signals(), pytest.raises(KeyboardInterrupt):
        commission({}, asked)
    assert told[-1].startswith(step)


def test_a_signal_whose_exception_is_lost_ends_it_at_the_next_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []
    lost: list[object] = []
    monkeypatch.setattr(sys, 'unraisablehook', lost.append)

    @ctypes.CFUNCTYPE(None)
    def called_from_c() -> None:
        _thread.interrupt_main(signal.SIGTERM)
        for _ in range(2):  # a handler runs at the latest where Python goes back
            pass

    def asked(boards: EmulatedBoards, question: str) -> None:
        told.append(question)
        tick = boards.tick

        def signalled() -> None:
            tick()
            if question.startswith('motor 1') and not lost:
                called_from_c()

        boards.tick = signalled  # type: ignore[method-assign]

    with _ended_by_signals() as signals, pytest.raises(KeyboardInterrupt):
        commission({}, asked, signals)
    assert lost
    assert told[-1].startswith('motor 1')


FAULT = Fault('board', 'a cable was loose', 'see to it', True)


def remembered(tmp_path: Path, load: float, **given: object) -> tuple[dict[str, object], Memory]:
    """Parameters with a memory of a fault, and of all phases' load."""
    claimed = {'boards.memory': str(tmp_path / 'boards.json'), **given}
    memory = Memory(build(BridgeParameters, claimed))
    memory.keep(np.full(12, load), FAULT, active=False)
    return claimed, memory


def ends_at(step: str) -> Callable[[EmulatedBoards, str], None]:
    def asked(_boards: EmulatedBoards, question: str) -> None:
        if question.startswith(step):
            raise StoppedError

    return asked


@pytest.mark.parametrize('step', ['a fault is latched', 'open', 'home', 'first lift-off'])
def test_load_and_fault_are_kept_until_all_is_well(step: str, tmp_path: Path) -> None:
    slow = {'amplifier.thermal_time': 600.0}
    claimed, memory = remembered(tmp_path, 0.8, **slow)
    with pytest.raises(StoppedError):
        commission(claimed, ends_at(step))
    load, fault = memory.recall()
    assert fault == FAULT
    assert np.all((load > 0.5) & (load < 0.8))


def test_a_machine_that_is_right_has_no_fault_any_more(tmp_path: Path) -> None:
    claimed, memory = remembered(tmp_path, 0.0)
    commission(claimed)
    assert memory.recall().fault is None


def test_a_last_line_that_fails_is_not_proven_any_more(tmp_path: Path) -> None:
    claimed, memory = remembered(tmp_path, 0.0, **LINES)
    parameters = build(BridgeParameters, claimed)
    with pytest.raises(StoppedError):
        commission(claimed, ends_at('home'))
    assert memory.proven(parameters)
    with pytest.raises(WrongError, match=r'boards\.stop_input \(0\) is another line'):
        commission({**claimed, 'emulation.wiring.stop_line': 5})
    assert not memory.proven(parameters)


def test_hot_amplifiers_cool_before_current_flows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [0.0]

    def sleep(seconds: float) -> None:
        now[0] += seconds

    clock = SimpleNamespace(monotonic=lambda: now[0], sleep=sleep)
    monkeypatch.setattr('maglev_hw_bridge.commissioning.commission.time', clock)
    claimed, _ = remembered(tmp_path, 0.97, **{'amplifier.thermal_time': 600.0})
    with pytest.raises(StoppedError):
        commission(claimed, ends_at('home'))
    assert 40.0 < now[0] < 80.0


def test_a_lift_off_that_fails_keeps_a_fault(tmp_path: Path) -> None:
    claimed, memory = remembered(tmp_path, 0.0)

    def asked(boards: EmulatedBoards, step: str) -> None:
        if step.startswith('first lift-off'):
            for phase in range(12):
                boards.dead(phase)

    with pytest.raises(WrongError, match=r'rose 0\.00 mm'):
        commission(claimed, asked)
    assert memory.recall().fault == FAULT


def test_what_is_killed_while_current_flows_comes_back_as_a_fault(tmp_path: Path) -> None:
    claimed, memory = remembered(tmp_path, 0.0)
    kinds: list[str] = []

    def asked(boards: EmulatedBoards, step: str) -> None:
        tick = boards.tick

        def looking() -> None:
            tick()
            if np.max(np.abs(boards.rig.phase_current)) > 0.4:
                boards.tick = tick  # type: ignore[method-assign]
                kinds.append(str(memory.recall().fault))

        boards.tick = looking  # type: ignore[method-assign]

    commission(claimed, asked)
    assert len(kinds) >= 6
    assert all('the last run ended without stopping' in kind for kind in kinds)


@pytest.mark.parametrize('presses_at', [0.0, 1.0])
def test_an_emergency_stop_ends_the_pulses(presses_at: float) -> None:
    """Pressed while it asks, and while so much current flows [A]."""
    flowed: list[float] = []

    def asked(boards: EmulatedBoards, step: str) -> None:
        if not step.startswith('motor 1'):
            return
        tick = boards.tick

        def pressing() -> None:
            tick()
            flowed.append(float(np.max(np.abs(boards.rig.phase_current))))
            boards.stop_pressed |= flowed[-1] >= presses_at

        boards.tick = pressing  # type: ignore[method-assign]
        boards.stop_pressed = presses_at == 0.0

    with pytest.raises(WrongError, match='the emergency stop is pressed'):
        commission(LINES, asked)
    assert max(flowed, default=0.0) <= 1.1 * presses_at


@pytest.mark.parametrize('phase', [pytest.param(0, marks=pytest.mark.long), 8])
def test_a_phase_turned_round(phase: int) -> None:
    sign = flipped(DEFAULT.amplifier.sign, phase)
    with pytest.raises(WrongError, match=rf'sign of element {phase} of amplifier\.sign'):
        commission({'amplifier.sign': sign})


@pytest.mark.parametrize('encoder', [pytest.param(1, marks=pytest.mark.long), 4])
def test_an_encoder_that_counts_the_other_way(encoder: int) -> None:
    direction = flipped(DEFAULT.encoder.direction, encoder)
    with pytest.raises(WrongError, match=rf'sign of element {encoder} of encoder\.direction'):
        commission({'encoder.direction': direction})


def test_a_count_that_is_worth_more_is_told_though_the_lift_off_looks_right() -> None:
    with pytest.raises(WrongError, match=r'element 0 of encoder\.resolution'):
        commission({'encoder.resolution': [5e-6] * 4 + [1e-5] * 2})


@pytest.mark.parametrize(
    'pair', [(1, 2), *(pytest.param(pair, marks=pytest.mark.long) for pair in ((1, 8), (4, 10)))]
)
def test_exchanged_phases(pair: tuple[int, int]) -> None:
    amplifier = DEFAULT.amplifier
    claimed = {
        'amplifier.board': exchanged(amplifier.board, *pair),
        'amplifier.channel': exchanged(amplifier.channel, *pair),
    }
    with pytest.raises(WrongError, match='elements {} and {} of amplifier'.format(*pair)):
        commission(claimed)


@pytest.mark.parametrize('pair', [(1, 4)])
def test_exchanged_encoders(pair: tuple[int, int]) -> None:
    claimed = {'encoder.channel': exchanged(DEFAULT.encoder.channel, *pair)}
    with pytest.raises(WrongError, match='elements {} and {} of encoder'.format(*pair)):
        commission(claimed)


def test_a_dead_phase_and_a_dead_encoder() -> None:
    inject = {'emulation.inject.sample': 0, 'emulation.inject.dead_phase': 5}
    with pytest.raises(WrongError, match='motor 2 phase c moves nothing'):
        commission(inject)
    inject = {'emulation.inject.sample': 0, 'emulation.inject.stuck_encoder': 3}
    with pytest.raises(WrongError, match='encoder gap 4 sees nothing'):
        commission(inject)


def test_the_executable(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = tmp_path / 'wrong.yaml'
    content = {'hw_bridge': {'ros__parameters': {'encoder': {'direction': [1, 1, 1, 1, 1, -1]}}}}
    wrong.write_text(yaml.safe_dump(content))
    assert run(['--params', str(PARAMS), '--yes']) == 0
    assert 'all is well' in capsys.readouterr().out
    assert run(['--params', str(PARAMS), '--params', str(wrong), '--yes', '--json']) == 1
    captured = capsys.readouterr()
    assert 'element 5 of encoder.direction' in captured.err
    outcome = json.loads(captured.out)
    assert outcome['passed'] is False
    assert 'element 5 of encoder.direction' in outcome['said'][-1]
    with pytest.raises(SystemExit):
        run(['--params', str(PARAMS), '--quiet'])
    assert '--quiet needs --yes' in capsys.readouterr().err
    assert run(['--params', str(tmp_path / 'none.yaml')]) == 1
    assert 'cannot read' in capsys.readouterr().err


@pytest.mark.parametrize('answers', [[], ['y', 'no']])
def test_it_asks_and_takes_no_for_an_answer(
    answers: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    typed, keyboard = os.pipe()
    os.write(keyboard, ''.join(f'{answer}\n' for answer in answers).encode())
    os.close(keyboard)
    with open(typed, encoding='utf-8') as stdin:
        monkeypatch.setattr('sys.stdin', stdin)
        assert run(['--params', str(PARAMS)]) == 130
    assert 'stopped' in capsys.readouterr().err
