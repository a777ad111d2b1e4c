"""A bare echo between two rclpy processes: the least a closed loop over ROS can cost.

``echo.py answer SPIN`` sends back, as a Currents message, the number of each Measurement it gets;
``echo.py ask SPIN SECONDS`` asks as fast as it is answered and prints the median round trip [s].
SPIN is ``default`` (rclpy.spin_once on the default executor) or ``events`` (EventsExecutor).
"""

from __future__ import annotations

import statistics
import sys
import time

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.task import Future

from maglev_msgs.msg import Currents, Measurement
from maglev_node.topics import sample_qos


class Echo:
    """Either end of the echo."""

    def __init__(self, ask: bool) -> None:
        self.node = rclpy.create_node('ask' if ask else 'answer')
        self.round_trips: list[float] = []
        self._sent = 0.0
        self._question, self._answer = Measurement(), Currents()
        if ask:
            self._publisher = self.node.create_publisher(Measurement, '/echo/ask', sample_qos())
            self.node.create_subscription(Currents, '/echo/answer', self._take, sample_qos())
            self.node.create_timer(0.5, self._begin)
        else:
            self._publisher = self.node.create_publisher(Currents, '/echo/answer', sample_qos())
            self.node.create_subscription(Measurement, '/echo/ask', self._reply, sample_qos())

    def _begin(self) -> None:
        if not self.round_trips:
            self._ask()

    def _ask(self) -> None:
        self._question.sequence += 1
        self._sent = time.perf_counter()
        self._publisher.publish(self._question)

    def _take(self, _message: Currents) -> None:
        self.round_trips.append(time.perf_counter() - self._sent)
        self._ask()

    def _reply(self, message: Measurement) -> None:
        self._answer.sequence = message.sequence
        self._publisher.publish(self._answer)

    def spin(self, executor: str, seconds: float) -> None:
        """Serve the node; every wait is bounded."""
        end = time.monotonic() + seconds
        if executor == 'default':
            while time.monotonic() < end:
                rclpy.spin_once(self.node, timeout_sec=0.1)
            return
        events, never = EventsExecutor(), Future()
        events.add_node(self.node)
        while time.monotonic() < end:
            events.spin_until_future_complete(never, timeout_sec=0.1)


def main() -> None:
    """Run one end."""
    ask = sys.argv[1] == 'ask'
    rclpy.init()
    echo = Echo(ask)
    echo.spin(sys.argv[2], float(sys.argv[3]) if ask else 3600.0)
    if ask:
        print(statistics.median(echo.round_trips))


if __name__ == '__main__':
    main()
