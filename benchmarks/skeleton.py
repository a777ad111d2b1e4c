"""The messages of the whole graph without what makes them: the least that such a graph can cost.

The same processes, topics, readers and quality of service as a scenario's, the same serialized
messages and the same executor, but nothing in between: the stage sends the next measurement when
its currents have come, the controller answers, nobody computes, records or looks.
``skeleton.py SECONDS`` starts them all and prints the median tick [s].
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from typing import Any

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future

from maglev_model.contract.wire import Incoming, Outgoing
from maglev_node.dds import prepare_middleware
from maglev_node.polling import PolledSubscription, PollingNode
from maglev_node.topics import (
    CONTROLLER_PROGRESS,
    CONTROLLER_STATE,
    CURRENTS,
    KEYS,
    MEASUREMENT,
    PROGRESS,
    PROGRESS_PERIOD,
    REFERENCE,
    SAMPLE_TOPICS,
    STAGE_PROGRESS,
    TRUE_STATE,
    sample_qos,
    sampled,
)

PARTS = ('watchers', 'stage', 'controller', 'reference')
LEAD = 64  # samples that references are ahead
READERS = 3  # of a measurement: controller, recorder and monitor


class Part:
    """One process of the graph."""

    def __init__(self, name: str) -> None:
        self.node = PollingNode(name)
        self.ticks: list[float] = []
        self._out: dict[str, tuple[Any, Outgoing]] = {}
        self._read = {topic: Incoming(KEYS[sampled(topic)]).read for topic in (*KEYS, *PROGRESS)}
        self._sequence = self._newest = 0
        self._sent = 0.0

    def publish(self, *topics: str) -> None:
        """Have publishers."""
        for topic in topics:
            kind, qos = sampled(topic), sample_qos(1) if topic in PROGRESS else sample_qos()
            publisher = self.node.create_publisher(SAMPLE_TOPICS[kind], topic, qos)
            self._out[topic] = publisher, Outgoing(KEYS[kind], 'stage')

    def hear(self, topic: str, callback: Any) -> None:
        """Be called for each message."""
        kind = SAMPLE_TOPICS[topic]
        self.node.create_subscription(kind, topic, callback, sample_qos(), raw=True)

    def every(self, period: float, action: Any) -> None:
        """Be called again and again."""
        self.node.create_timer(period, action)

    def taps(self, depth: int, *topics: str) -> list[PolledSubscription]:
        """Queues that are looked at now and then."""
        return [
            self.node.poll(topic, SAMPLE_TOPICS[sampled(topic)], sample_qos(depth), raw=True)
            for topic in topics
        ]

    def send(self, topic: str, sequence: int) -> None:
        """Publish one message."""
        publisher, message = self._out[topic]
        message['sequence'] = sequence
        publisher.publish(message.serialized())

    def stage(self) -> None:
        """Send a measurement and the truth, once its currents have come the next."""
        self.publish(MEASUREMENT, STAGE_PROGRESS, TRUE_STATE)
        self.hear(CURRENTS, self._answered)
        self.every(0.1, self._begin)

    def _begin(self) -> None:
        heard = [
            self._out[topic][0].get_subscription_count() for topic in (MEASUREMENT, STAGE_PROGRESS)
        ]
        if heard == [READERS, 1] and not self.ticks:
            self._advance()

    def _answered(self, message: bytes) -> None:
        if self._read[CURRENTS](message).sequence == self._sequence:
            self.ticks.append(time.perf_counter() - self._sent)
            self._advance()

    def _advance(self) -> None:
        self._sequence += 1
        self._sent = time.perf_counter()
        self.send(MEASUREMENT, self._sequence)
        if self._sequence % PROGRESS_PERIOD == 0:
            self.send(STAGE_PROGRESS, self._sequence)
        self.send(TRUE_STATE, self._sequence)

    def controller(self) -> None:
        """Answer each measurement, tell of it, and take what references have come."""
        self.publish(CURRENTS, CONTROLLER_STATE, CONTROLLER_PROGRESS)
        (references,) = self.taps(16384, REFERENCE)

        def answer(message: bytes) -> None:
            sequence = self._read[MEASUREMENT](message).sequence
            self.send(CURRENTS, sequence)
            self.send(CONTROLLER_STATE, sequence)
            if sequence % PROGRESS_PERIOD == 0:
                self.send(CONTROLLER_PROGRESS, sequence)

        def take() -> None:
            for message, _ in references.take():
                self._read[REFERENCE](message)

        self.hear(MEASUREMENT, answer)
        self.every(2e-3, take)

    def reference(self) -> None:
        """Send references so far ahead of the newest measurement."""
        self.publish(REFERENCE)
        measurements, states = self.taps(1, STAGE_PROGRESS, CONTROLLER_PROGRESS)

        def look() -> None:
            for message, _ in states.take(1):
                self._read[CONTROLLER_PROGRESS](message)
            for message, _ in measurements.take(1):
                ahead = self._read[STAGE_PROGRESS](message).sequence + LEAD
                for sequence in range(self._newest + 1, ahead + 1):
                    self.send(REFERENCE, sequence)
                self._newest = ahead

        self.every(4e-3, look)

    def watchers(self) -> None:
        """Take everything, twice."""
        for _ in range(2):
            taps = self.taps(16384, *KEYS)
            self.every(0.05, lambda taps=taps: [list(tap.take()) for tap in taps])

    def spin(self, seconds: float) -> None:
        """Serve the node; every wait is bounded."""
        executor, never = EventsExecutor(), Future()
        executor.add_node(self.node)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            executor.spin_until_future_complete(never, timeout_sec=0.1)


def tick(seconds: float) -> float:
    """Median tick of all the processes together [s]."""
    commands = [[sys.executable, __file__, str(seconds), part] for part in PARTS]
    others = [subprocess.Popen(command) for command in commands if command[-1] != 'stage']
    try:
        done = subprocess.run(
            commands[PARTS.index('stage')], check=True, capture_output=True, text=True
        )
    finally:
        for process in others:
            process.kill()
            process.wait()
    return float(done.stdout)


def main() -> None:
    """All of them, or one."""
    seconds = float(sys.argv[1])
    if len(sys.argv) == 2:
        print(tick(seconds))
        return
    prepare_middleware()
    rclpy.init()
    part = Part(sys.argv[2])
    getattr(part, sys.argv[2])()
    part.spin(seconds if sys.argv[2] == 'stage' else 3600.0)
    if sys.argv[2] == 'stage':
        print(statistics.median(part.ticks))


if __name__ == '__main__':
    main()
