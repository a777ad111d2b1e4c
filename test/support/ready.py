"""Imports and makes what nodes need; so has the server from which they are forked."""

from __future__ import annotations

from maglev_controller.parameters import ControllerParameters
from maglev_controller.supervision import Supervisor
from maglev_hw_bridge.parameters import BridgeParameters
from maglev_hw_bridge.stage import BridgeStage
from maglev_model.parameters import build
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.timeline import Timeline

Supervisor(ControllerParameters())
Timeline(ReferenceParameters())
_stage = BridgeStage.ready(build(BridgeParameters, {'homing.at_start': True}))
_stage.read()
_stage.hold()
_stage.close()
