"""A bridge at rest whose boards have everything wired: stop input, enable line, offsets."""

from __future__ import annotations

from bridge_flight import HOME

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.parameters import build

OFFSET = [0.3, -0.2] * 6  # what makes no current [V]
_WIRED = {
    **HOME,
    'boards.stop_input': 0,
    'boards.enable_output': 1,
    'amplifier.offset': OFFSET,
    'emulation.wiring.offset': OFFSET,
}


def bridge(**overrides: object) -> tuple[BridgeStage, EmulatedBoards]:
    """Stage and boards, not configured; ``__`` in a parameter's name stands for a dot."""
    names = {name.replace('__', '.'): value for name, value in overrides.items()}
    parameters = build(BridgeParameters, {**_WIRED, **names})
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    return BridgeStage(parameters, driver=driver), boards
