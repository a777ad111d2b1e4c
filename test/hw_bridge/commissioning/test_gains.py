"""What a volt makes of each amplifier is seen by an ammeter, and what it makes of none."""

from __future__ import annotations

import os

import numpy as np
import pytest

from maglev_hw_bridge.amplifiers import Amplifiers
from maglev_hw_bridge.commissioning.gains import measured_current, prove_gains
from maglev_hw_bridge.commissioning.operators import EmulatedPerson, Meanwhile, Person
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.signal_parameters import PHASE_NAMES
from maglev_model.parameters import build


class Reader(EmulatedPerson):
    """Who remembers what was read, and of the boards what was asked for meanwhile."""

    def __init__(self, boards: EmulatedBoards) -> None:
        super().__init__(boards, lambda _step: None)
        self.read: list[tuple[int, float]] = []
        self.resting = True

    def connect_meter(self, phase: int) -> None:
        self.wait(0.01)
        self.resting &= bool(np.all(np.abs(self._boards.rig.phase_current) < 1e-3))

    def reads_current(self, phase: int, meanwhile: Meanwhile) -> float:
        seen = super().reads_current(phase, meanwhile)
        assert np.sum(np.abs(self._boards.rig.phase_current) > 0.11) <= 1
        self.read.append((phase, seen))
        return seen


def prove(whom: type[Reader] = Reader, /, **given: object) -> Reader:
    """Measure a machine whose loads are connected; none of them carries anything in the end."""
    claimed = {name.replace('__', '.'): value for name, value in given.items()}
    parameters = build(BridgeParameters, claimed)
    boards = EmulatedBoards(parameters)
    boards.dummy_loads = True
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    reader = whom(boards)
    driver.open()
    try:
        prove_gains(parameters, driver, Amplifiers(parameters), reader)
    finally:
        driver.close()
        boards.sleep(0.05)
        assert not np.any(np.abs(boards.rig.phase_current) > 0.15)
    return reader


def but(index: int, value: float, others: float) -> list[float]:
    """The same for each phase but one."""
    return [value if i == index else others for i in range(12)]


def test_every_load_is_measured_with_nothing_and_with_an_ampere() -> None:
    reader = prove()
    assert [phase for phase, _ in reader.read] == [*np.repeat(np.arange(12), 2)]
    assert [seen for _, seen in reader.read] == pytest.approx([0.0, 1.0] * 12, abs=1e-3)
    assert reader.resting


def test_small_amplifiers_are_measured_with_half_of_what_they_carry() -> None:
    small = {'amplifier__continuous_current': 1.2}
    assert [seen for _, seen in prove(**small).read] == pytest.approx([0.0, 0.6] * 12, abs=1e-3)
    assert measured_current(build(BridgeParameters, {})) == 1.0


@pytest.mark.parametrize('phase', range(12))
@pytest.mark.parametrize('factor', [0.1, 0.5, 0.94, 1.06, 2.0, 10.0])
def test_a_wrong_gain_is_told_of_each_amplifier(phase: int, factor: float) -> None:
    wrong = rf'{PHASE_NAMES[phase]} carries .* element {phase} of amplifier\.gain'
    with pytest.raises(WrongError, match=wrong):
        prove(emulation__wiring__gain=but(phase, factor, 1.0))


def test_all_gains_wrong_alike_are_told() -> None:
    with pytest.raises(WrongError, match=r'carries 1\.70 A where 1 A are commanded'):
        prove(emulation__wiring__gain=[1.7] * 12)


@pytest.mark.parametrize('factor', [0.96, 1.04])
def test_gains_need_not_be_exact(factor: float) -> None:
    prove(emulation__wiring__gain=[factor] * 12, emulation__wiring__phase_sign=[-1] * 12)


@pytest.mark.parametrize('phase', [0, 5, 11])
@pytest.mark.parametrize('volts', [-0.11, 0.11])
def test_what_flows_with_none_commanded_is_told(phase: int, volts: float) -> None:
    wrong = rf'{PHASE_NAMES[phase]} carries {volts:g} A where none .* element {phase} of'
    with pytest.raises(WrongError, match=wrong + r' amplifier\.offset'):
        prove(emulation__wiring__offset=but(phase, -volts, 0.0))
    small, gain = but(phase, 0.09, 0.0), [1.04] * 12
    prove(emulation__wiring__offset=small, emulation__wiring__gain=gain)


def test_what_is_connected_elsewhere_is_left_to_the_phases() -> None:
    prove(emulation__wiring__phase_channel=[1, 0, *range(2, 6), *range(6)])


def test_the_emergency_stop_ends_it() -> None:
    class Presses(Reader):
        def connect_meter(self, phase: int) -> None:
            self._boards.stop_pressed = phase == 3

    with pytest.raises(WrongError, match='the emergency stop is pressed'):
        prove(Presses, boards__stop_input=0)


def test_what_is_no_number_is_asked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal, keyboard = os.pipe()
    typed = ['abc\n', 'nan\n', '', '-0.98\n']
    with open(terminal) as stdin, open(keyboard, 'w', buffering=1) as keys:
        monkeypatch.setattr('sys.stdin', stdin)
        read = Person().reads_current(3, lambda: print(typed.pop(0), end='', file=keys))
    assert (read, typed) == (-0.98, [])
