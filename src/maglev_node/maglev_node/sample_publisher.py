"""What a stage publishes of each sample: what it measured, and the truth where that is known."""

from __future__ import annotations

import time
from typing import Any, TypeVar

from rosgraph_msgs.msg import Clock

from maglev_model.stage import EncoderSample, Truth
from maglev_msgs.msg import Measurement, PlantState
from maglev_node.graph_guard import Watchers
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.stamp import copy_stamp, set_stamp
from maglev_node.topics import CLOCK, MEASUREMENT, TRUE_STATE, sample_qos

_CLOCK_SAMPLES = 10
"""Samples from one message on ``clock`` to the next."""

P = TypeVar('P', bound=SourceParameters)


class SamplePublisher:
    """The measurement of each sample and, with ``truth``, the true state it was taken from.

    Stamps are stage time: the wall clock at the first sample since :meth:`start`, plus
    ``sample_time`` [s] for each further one. In lockstep ``clock`` tells it to the graph.
    """

    def __init__(self, node: MaglevNode[P], sample_time: float, *, truth: bool) -> None:
        self._node = node
        self._period = round(1e9 * sample_time)  # [ns]
        self._first: tuple[int, int] | None = None  # sample, and its time [ns]
        self._clock, self._measurement, self._true_state = Clock(), Measurement(), PlantState()
        self._measurement.header.frame_id = self._true_state.header.frame_id = 'stage'
        self._measurement.lockstep = node.parameters.mode == 'lockstep'
        self._publisher: Any = node.create_publisher(Measurement, MEASUREMENT, sample_qos())
        self._topics = [MEASUREMENT]
        self._watchers = Watchers(node, node.parameters.watchers)
        self._true_publisher: Any = None
        if truth:
            self._topics.append(TRUE_STATE)
            self._true_publisher = node.create_publisher(PlantState, TRUE_STATE, sample_qos())
        self._clock_publisher: Any = None
        if self._measurement.lockstep:
            self._clock_publisher = node.create_publisher(Clock, CLOCK, sample_qos())

    def start(self) -> None:
        """Let stage time begin with what is published next."""
        self._first = None

    def publish(
        self,
        sequence: int,
        sample: EncoderSample,
        late_samples: int,
        controller: int,
        truth: Truth | None,
    ) -> None:
        """Publish one sample; ``controller`` is the session of the one whose currents flow."""
        message = self._measurement
        message.wall_time = time.time_ns()
        if self._first is None:
            self._first = sequence, message.wall_time
        set_stamp(message.header.stamp, self.stage_time(sequence))
        message.sequence = sequence
        message.gap, message.x, message.z = sample
        message.late_samples = late_samples
        message.controller = controller
        self._publisher.publish(message)
        if truth is not None and self._true_publisher is not None:
            self._publish_truth(truth)
        since = sequence - self._first[0]
        if self._clock_publisher is not None and since % _CLOCK_SAMPLES == 0:
            copy_stamp(message.header.stamp, self._clock.clock)
            self._clock_publisher.publish(self._clock)

    def stage_time(self, sequence: int) -> int:
        """The stamp of a sample [ns since the epoch]; 0 before the first was published."""
        if self._first is None:
            return 0
        return self._first[1] + (sequence - self._first[0]) * self._period

    def watched(self) -> bool:
        """Whether all who shall see every sample are there; now and then says who is not."""
        return self._watchers.there(*self._topics)

    def missing(self) -> list[str]:
        """Names of those who shall see every sample and are not there."""
        return self._watchers.missing(*self._topics)

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in (self._publisher, self._true_publisher, self._clock_publisher):
            if publisher is not None:
                self._node.destroy_publisher(publisher)

    def _publish_truth(self, truth: Truth) -> None:
        state = self._true_state
        copy_stamp(self._measurement.header.stamp, state.header.stamp)
        state.sequence = self._measurement.sequence
        state.state, state.direct_current, state.quadrature_current = truth[:3]
        state.thermal_load, state.own_length = truth.thermal_load, truth.own_length
        self._true_publisher.publish(state)
