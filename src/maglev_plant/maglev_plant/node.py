"""The simulated stage's node: the stage contract over the simulated plant."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import ClassVar

from maglev_node.stage_node import StageNode
from maglev_node.stage_parameters import ClockedStageParameters
from maglev_node.topics import TRUE_STATE
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage


@dataclasses.dataclass(frozen=True, kw_only=True)
class PlantNodeParameters(ClockedStageParameters, PlantParameters):
    """The plant and how its node runs it."""


class PlantNode(StageNode[PlantNodeParameters, SimulatedStage]):
    """Flies the simulated stage, in lockstep or in real time."""

    interface: ClassVar[Mapping[str, str]] = {
        **StageNode.interface,
        TRUE_STATE: 'published: the true state at the instant of each measurement',
    }

    def __init__(self) -> None:
        super().__init__('plant', PlantNodeParameters, SimulatedStage)

    def on_parameters(self, parameters: PlantNodeParameters) -> None:
        """Let the stage know its new watchdog."""
        if self.configured:
            self.stage.watchdog = parameters.watchdog
