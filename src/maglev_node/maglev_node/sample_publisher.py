"""What a stage publishes of each sample: what it measured, and the truth where that is known."""

from __future__ import annotations

from typing import Any, TypeVar

from maglev_model.stage import EncoderSample, Truth
from maglev_msgs.msg import Measurement, PlantState
from maglev_node.graph_guard import Watchers
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.stamp import copy_stamp, stamp_now
from maglev_node.topics import MEASUREMENT, TRUE_STATE, sample_qos

P = TypeVar('P', bound=SourceParameters)


class SamplePublisher:
    """The measurement of each sample and, with ``truth``, the true state it was taken from."""

    def __init__(self, node: MaglevNode[P], *, truth: bool) -> None:
        self._node = node
        self._measurement, self._true_state = Measurement(), PlantState()
        self._measurement.header.frame_id = self._true_state.header.frame_id = 'stage'
        self._publisher: Any = node.create_publisher(Measurement, MEASUREMENT, sample_qos())
        self._true_publisher: Any = None
        self._topics = [MEASUREMENT]
        self._watchers = Watchers(node, node.parameters.watchers)
        if truth:
            self._topics.append(TRUE_STATE)
            self._true_publisher = node.create_publisher(PlantState, TRUE_STATE, sample_qos())

    def publish(
        self, sequence: int, sample: EncoderSample, late_samples: int, truth: Truth | None
    ) -> None:
        """Publish one sample, stamped now."""
        message = self._measurement
        stamp_now(message.header.stamp)
        message.sequence = sequence
        message.gap, message.x, message.z = sample
        message.late_samples = late_samples
        self._publisher.publish(message)
        if truth is not None and self._true_publisher is not None:
            state = self._true_state
            copy_stamp(message.header.stamp, state.header.stamp)
            state.sequence = sequence
            state.state, state.direct_current, state.quadrature_current = truth[:3]
            state.thermal_load = truth.thermal_load
            self._true_publisher.publish(state)

    def watched(self) -> bool:
        """Whether all who shall see every sample are there; now and then says who is not."""
        return self._watchers.there(*self._topics)

    def missing(self) -> list[str]:
        """Names of those who shall see every sample and are not there."""
        return self._watchers.missing(*self._topics)

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in (self._publisher, self._true_publisher):
            if publisher is not None:
                self._node.destroy_publisher(publisher)
