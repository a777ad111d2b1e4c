"""A process on the graph before its nodes are, which take their time to load."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.node import Node
from rclpy.parameter import Parameter

_since = None  # when the middleware of this process began to look around [s]


@contextmanager
def looking_around(name: str) -> Iterator[None]:
    """Be on the graph, so that the middleware finds the others meanwhile, in threads of its own.

    By a node that nobody asks for anything, and which ``ros2 node list`` does not show. Those that
    are made meanwhile take over what was found.
    """
    global _since
    node = Node(
        f'_{name}_loading',
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )
    _since = time.monotonic()
    try:
        yield
    finally:
        node.destroy_node()


def since() -> float:
    """When the middleware began to look around [s, monotonic], now where nothing told it to."""
    return time.monotonic() if _since is None else _since
