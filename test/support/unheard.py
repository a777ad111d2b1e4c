"""A publisher whose reader is stopped, and what that costs it: ``unheard.py MODE``, heap kept.

Prints the page faults of a publish, by number of samples that the reader has not acknowledged.
"""

from __future__ import annotations

import contextlib
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import rclpy

from maglev_model.contract.wire import KEPT
from maglev_msgs.msg import Measurement
from maglev_node.dds import prepare_middleware
from maglev_node.realtime import keep_heap
from maglev_node.topics import MEASUREMENT, sample_qos

STRETCH = 3500  # samples


def read() -> None:
    """Be the reader."""
    prepare_middleware()
    rclpy.init()
    node = rclpy.create_node('reader')
    node.create_subscription(Measurement, MEASUREMENT, lambda _: None, sample_qos())
    rclpy.spin(node)


@contextlib.contextmanager
def unheard(depth: int) -> Iterator[Any]:
    """A publisher of measurements that keeps ``depth`` of them; its only reader is stopped."""
    prepare_middleware()
    reader = subprocess.Popen([sys.executable, __file__])
    try:
        rclpy.init()
        node = rclpy.create_node('writer')
        publisher = node.create_publisher(Measurement, MEASUREMENT, sample_qos(depth))
        while not publisher.get_subscription_count():
            time.sleep(0.05)
        reader.send_signal(signal.SIGSTOP)
        yield publisher
    finally:
        reader.kill()
        reader.wait()


def main(mode: str) -> None:
    """Publish, and count page faults."""
    keep_heap()
    with unheard(KEPT[mode]) as publisher:
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
            for _ in range(STRETCH):
                publisher.publish(Measurement())
            faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
            print(faults / STRETCH)


if __name__ == '__main__':
    if len(sys.argv) == 1:
        read()
    else:
        main(sys.argv[1])
