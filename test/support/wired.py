"""A bridge at rest whose boards have everything wired: stop input, enable line, offsets."""

from __future__ import annotations

from driven import bridge_parameters

from maglev_hw_bridge.drivers.emulated import EmulatedBoards
from maglev_hw_bridge.drivers.quanser import QuanserDriver
from maglev_hw_bridge.stage import BridgeStage

OFFSET = [0.3, -0.2] * 6  # what makes no current [V]
_WIRED = {
    'homing__at_start': True,
    'homing__x': 0.0,
    'homing__z': 0.0,
    'boards__stop_input': 0,
    'boards__enable_output': 1,
    'amplifier__offset': OFFSET,
    'emulation__wiring__offset': OFFSET,
}


def bridge(**overrides: object) -> tuple[BridgeStage, EmulatedBoards]:
    """Stage and boards, not configured; ``__`` in a parameter's name stands for a dot."""
    parameters = bridge_parameters(**{**_WIRED, **overrides})
    boards = EmulatedBoards(parameters)
    driver = QuanserDriver(parameters, boards, boards.now, boards.sleep)
    return BridgeStage(parameters, driver=driver), boards
