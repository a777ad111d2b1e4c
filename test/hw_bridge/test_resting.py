"""On its lower stop: lifted to tell it from the upper one."""

from __future__ import annotations

import numpy as np
import pytest

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.encoders import HomingError
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.guide import GuideParameters
from maglev_model.parameters import build

UPPER_STOP, LOWER_STOP = 0.018, 0.031
FRICTION = np.array(GuideParameters().coulomb)

HEAVY = {'K_v1': 0.9, 'K_v2': 0.9, 'K_v3': 0.9, 'mass_y': 1.1}
LIGHT = {'K_v1': 1.1, 'K_v2': 1.1, 'K_v3': 1.1, 'mass_y': 0.9}


def machine(place: float, friction: float, offset: dict[str, float]) -> BridgeStage:
    """A bridge, ready to home, to a machine that rests there."""
    parameters = build(
        BridgeParameters,
        {
            'homing.x': 0.0,
            'homing.z': 0.0,
            'emulation.guide.coulomb': (friction * FRICTION).tolist(),
            **{f'emulation.offset.{name}': value for name, value in offset.items()},
        },
    )
    boards = EmulatedBoards(parameters)
    boards.rig.place(np.array([place, 0.0, 0.0, 0.0, 0.0]))
    for _ in range(50):
        boards.tick()
    assert boards.rig.state[0] == pytest.approx(place, abs=1e-5)
    stage = BridgeStage(
        parameters, driver=QuanserDriver(parameters, boards, boards.now, boards.sleep)
    )
    stage.configure()
    return stage


@pytest.mark.parametrize('friction', [0.2, 2.0])
@pytest.mark.parametrize('offset', [HEAVY, LIGHT])
def test_homing_tells_the_stops_apart_on_any_sound_machine(
    offset: dict[str, float], friction: float
) -> None:
    stage = machine(LOWER_STOP, friction, offset)
    stage.home()
    assert stage.encoders.homed
    stage.activate()
    stage.close()
    stage = machine(UPPER_STOP, friction, offset)
    with pytest.raises(HomingError, match=r'the platen rose 0\.0.* upper stop'):
        stage.home()
    assert not stage.encoders.homed
    stage.close()


def test_what_is_heavier_than_any_sound_machine_is_not_lifted() -> None:
    stage = machine(LOWER_STOP, 2.0, {**HEAVY, 'mass_y': 1.25})
    with pytest.raises(HomingError, match='something holds it'):
        stage.home()
    stage.close()
