"""A node of somebody else's: plain rclpy, on every topic of the stage, with a default queue."""

from __future__ import annotations

from collections import Counter
from typing import Any

import rclpy
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from maglev_node.topics import CLOCK, SAMPLE_TOPICS


def main() -> None:
    """Subscribe, say so, and say when the first message of a topic has come."""
    rclpy.init()
    node = Node('stranger')
    heard: Counter[str] = Counter()

    def hear(topic: str) -> Any:
        def count(_message: Any) -> None:
            heard[topic] += 1
            if heard[topic] == 1:
                print(f'hears {topic}', flush=True)

        return count

    for topic, message_type in {**SAMPLE_TOPICS, CLOCK: Clock}.items():
        node.create_subscription(message_type, topic, hear(topic), 10)
    print('listening', flush=True)
    rclpy.spin(node)


if __name__ == '__main__':
    main()
