"""A process that leaves the graph hears nothing more, and is heard to leave."""

from __future__ import annotations

import sys

from graph import Nodes, Observer
from std_msgs.msg import Empty

LEAVER = """
import time
import rclpy
from std_msgs.msg import Empty
from maglev_node.dds import prepare_middleware
from maglev_node.leaving import stop_receiving

prepare_middleware()
rclpy.init()
node = rclpy.create_node('leaver')
node.create_publisher(Empty, 'last_words', 1)
while not node.count_subscribers('last_words'):
    time.sleep(0.01)
stop_receiving()
print('deaf', flush=True)
time.sleep(2.0)
print('hears', node.count_publishers('too_late'), flush=True)
node.destroy_node()
rclpy.shutdown()
"""


def test_who_leaves_hears_of_nobody_and_is_heard(nodes: Nodes, watching: Observer) -> None:
    """Else Fast DDS may wait for ever, when it is told of others while its participant goes."""
    watching.node.create_subscription(Empty, 'last_words', lambda _: None, 1)
    leaver = nodes.run('leaver', [sys.executable, '-c', LEAVER])
    leaver.wait_for('deaf')
    watching.node.create_publisher(Empty, 'too_late', 1)
    leaver.wait_for('hears')
    assert 'hears 0' in leaver.output
    assert leaver.wait() == 0
    watching.wait(lambda: watching.node.count_publishers('last_words') == 0, timeout=5.0)
