"""What a stage publishes of each sample: what it measured, and the truth where that is known."""

from __future__ import annotations

import time
from typing import Any, TypeVar

from rosgraph_msgs.msg import Clock

from maglev_model.contract.controller_watch import NOBODY
from maglev_model.contract.stage import EncoderSample, Truth
from maglev_model.contract.wire import KEPT
from maglev_node.graph_guard import Watchers
from maglev_node.node import MaglevNode, SourceParameters
from maglev_node.samples import ProgressWriter, SampleWriter
from maglev_node.stamp import set_stamp
from maglev_node.topics import CLOCK, MEASUREMENT, STAGE_PROGRESS, TRUE_STATE, sample_qos

_CLOCK_SAMPLES = 10
"""Samples from one message on ``clock`` to the next."""

P = TypeVar('P', bound=SourceParameters)


class SamplePublisher:
    """The measurement of each sample and, with ``truth``, the true state it was taken from.

    Stamps are stage time: the wall clock at the first sample since :meth:`start`, plus
    ``sample_time`` [s] for each further one. It never goes back, also where it was ahead of the
    wall clock, as in lockstep. There ``clock`` tells it to the graph. ``watchers`` are those who
    shall see every sample.
    """

    def __init__(self, node: MaglevNode[P], sample_time: float, *, truth: bool) -> None:
        self._node = node
        self._period = round(1e9 * sample_time)  # [ns]
        self._first: tuple[int, int] | None = None  # sample, and its time [ns]
        self._newest = 0  # stamp of what was published last [ns]
        lockstep = node.parameters.mode == 'lockstep'
        qos = sample_qos(KEPT[node.parameters.mode])
        self._measurement = SampleWriter(node, MEASUREMENT, qos)
        self._measurement['lockstep'] = lockstep
        self._progress = ProgressWriter(node, STAGE_PROGRESS, self._measurement)
        topics = (MEASUREMENT, TRUE_STATE) if truth else (MEASUREMENT,)
        self.watchers = Watchers(node, node.parameters.watchers, *topics)
        self._true_state = SampleWriter(node, TRUE_STATE, qos) if truth else None
        self._clock = Clock()
        self._clock_publisher: Any = None
        if lockstep:
            self._clock_publisher = node.create_publisher(Clock, CLOCK, qos)

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
        message, wall_time = self._measurement, time.time_ns()
        if self._first is None:
            self._first = sequence, max(wall_time, self._newest + self._period)
        self._newest = stamp = self.stage_time(sequence)
        message.set_stamp(stamp)
        message['sequence'], message['wall_time'] = sequence, wall_time
        message['gap'], message['x'], message['z'] = sample
        message['late_samples'], message['controller'] = late_samples, controller
        message.publish()
        self._progress.publish(sequence, steady=controller != NOBODY)
        if truth is not None and self._true_state is not None:
            self._publish_truth(self._true_state, sequence, stamp, truth)
        since = sequence - self._first[0]
        if self._clock_publisher is not None and since % _CLOCK_SAMPLES == 0:
            set_stamp(self._clock.clock, stamp)
            self._clock_publisher.publish(self._clock)

    def stage_time(self, sequence: int) -> int:
        """The stamp of a sample [ns since the epoch]; 0 before the first was published."""
        if self._first is None:
            return 0
        return self._first[1] + (sequence - self._first[0]) * self._period

    def destroy(self) -> None:
        """Leave the graph."""
        publishers = [self._measurement.publisher, self._progress.publisher]
        if self._true_state is not None:
            publishers.append(self._true_state.publisher)
        if self._clock_publisher is not None:
            publishers.append(self._clock_publisher)
        for publisher in publishers:
            self._node.destroy_publisher(publisher)

    @staticmethod
    def _publish_truth(message: SampleWriter, sequence: int, stamp: int, truth: Truth) -> None:
        message.set_stamp(stamp)
        message['sequence'] = sequence
        for field, value in zip(Truth._fields, truth, strict=True):
            message[field] = value
        message.publish()
