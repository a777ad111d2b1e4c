"""A writer whose reader is stopped, and what that costs it: ``unheard.py MODE as_it_is|kept``.

Prints the page faults of a publish, by number of samples that the reader has not acknowledged.
"""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import time

import rclpy

from maglev_msgs.msg import Measurement
from maglev_node.dds import prepare_middleware
from maglev_node.realtime import keep_heap
from maglev_node.topics import KEPT, MEASUREMENT, sample_qos

STRETCH = 3500  # samples


def read() -> None:
    """Be the reader."""
    rclpy.init()
    node = rclpy.create_node('reader')
    node.create_subscription(Measurement, MEASUREMENT, lambda _: None, sample_qos())
    rclpy.spin(node)


def write(depth: int) -> None:
    """Be the writer."""
    reader = subprocess.Popen([sys.executable, __file__])
    rclpy.init()
    node = rclpy.create_node('writer')
    publisher = node.create_publisher(Measurement, MEASUREMENT, sample_qos(depth))
    try:
        while not publisher.get_subscription_count():
            time.sleep(0.05)
        reader.send_signal(signal.SIGSTOP)
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            for _ in range(STRETCH):
                publisher.publish(Measurement())
            faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
            print(faults / STRETCH)
    finally:
        reader.kill()
        reader.wait()


if __name__ == '__main__':
    prepare_middleware()
    if len(sys.argv) == 1:
        read()
    else:
        if sys.argv[2] == 'kept':
            keep_heap()
        write(KEPT[sys.argv[1]])
