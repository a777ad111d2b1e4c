"""The simulated stage's node: the stage contract over the simulated plant, and its true state."""

from __future__ import annotations

import dataclasses

from maglev_msgs.msg import PlantState
from maglev_node.node import main as run_main
from maglev_node.stage_node import ClockedStageParameters, StageNode
from maglev_node.stamp import copy_stamp
from maglev_node.topics import TRUE_STATE, sample_qos
from maglev_plant.parameters import PlantParameters
from maglev_plant.simulation import SimulatedStage


@dataclasses.dataclass(frozen=True, kw_only=True)
class PlantNodeParameters(ClockedStageParameters, PlantParameters):
    """The plant and how its node runs it."""


class PlantNode(StageNode):
    """Publishes beside each measurement the true state it was taken from."""

    stage: SimulatedStage

    def __init__(self) -> None:
        super().__init__('plant', PlantNodeParameters, SimulatedStage)
        self._warm_up()
        self._true_state = PlantState()
        self._true_state.header.frame_id = 'stage'
        self._true_publisher = self.create_publisher(PlantState, TRUE_STATE, sample_qos())

    def _warm_up(self) -> None:
        """Compile, or load what was compiled, before the first sample asks for it."""
        spare = SimulatedStage(self.parameters)
        for _ in range(2):
            spare.read()
            spare.write(self._zero, self._zero)

    def watched(self) -> bool:
        """Whether the true state is watched too."""
        watchers = self._true_publisher.get_subscription_count()
        return super().watched() and bool(watchers >= self.parameters.watchers)

    def publish_more(self) -> None:
        """The true state of this sample."""
        message = self._true_state
        copy_stamp(self.measurement.header.stamp, message.header.stamp)
        message.sequence = self.sequence
        message.state = self.stage.state
        message.direct_current = self.stage.direct_current
        message.quadrature_current = self.stage.quadrature_current
        message.thermal_load = self.stage.thermal_load
        self._true_publisher.publish(message)


def main() -> None:
    """Entry point of the executable ``plant``."""
    run_main(PlantNode, 'plant')
