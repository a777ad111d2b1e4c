"""A stage on boards, ready for its first sample in one call."""

from __future__ import annotations

from maglev_hw_bridge.drivers import Driver
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.parameters import build


def open_stage(
    parameters: BridgeParameters, *, realtime: bool = False, driver: Driver | None = None
) -> BridgeStage:
    """A stage that is configured and active. Raises StageError, ParameterError."""
    stage = BridgeStage(parameters, realtime=realtime, driver=driver)
    stage.configure()
    stage.activate()
    return stage


def warm_up() -> None:
    """Compile all that a sample needs, of the emulated boards too, or load it from the cache."""
    stage = open_stage(build(BridgeParameters, {'homing.at_start': True}))
    stage.read()
    stage.hold()
    stage.close()
