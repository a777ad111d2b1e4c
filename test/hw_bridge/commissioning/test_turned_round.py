"""A machine on which everything is numbered 90 degrees round looks right to its own encoders."""

from __future__ import annotations

import pytest
from bridge_flight import HOME

from maglev_hw_bridge.commissioning.commission import Commissioning
from maglev_hw_bridge.commissioning.operators import EmulatedPerson, Meanwhile
from maglev_hw_bridge.commissioning.proof import WrongError
from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_model.parameters import build

PHASES = [(3 + k) % 12 for k in range(12)]  # of the motor after each
TURNED = {
    'amplifier.board': [k // 6 for k in PHASES],
    'amplifier.channel': [k % 6 for k in PHASES],
    'encoder.channel': [1, 2, 3, 0, 5, 4],
}


class Misled(EmulatedPerson):
    """Somebody who goes by the numbers that are written on the motors, which are turned too."""

    def sees_current(self, phase: int, meanwhile: Meanwhile | None = None) -> bool:
        return super().sees_current(PHASES[phase], meanwhile)

    def reads_current(self, phase: int, meanwhile: Meanwhile) -> float:
        return super().reads_current(PHASES[phase], meanwhile)


def test_everything_numbered_90_degrees_round_is_told() -> None:
    parameters = build(BridgeParameters, {**HOME, **TURNED})
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    told: list[str] = []
    operator = Misled(boards, lambda _step: None)
    steps = Commissioning(parameters, driver, peak=1.5, operator=operator, tell=told.append)
    with pytest.raises(WrongError, match='90 degrees round'):
        steps.run()
    assert 'electrical angles are as believed' in told[-1], 'the phases alone do not tell'
    assert not boards.cards
