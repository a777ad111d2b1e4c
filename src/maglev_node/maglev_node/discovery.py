"""Discovery that begins before a process has its nodes, which take their time to load."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rclpy.node import Node
from rclpy.parameter import Parameter

from maglev_node.leaving import stop_receiving

_begun: float | None = None  # when, in this process [s]


@contextmanager
def discovering(name: str) -> Iterator[None]:
    """Let the middleware, in threads of its own, find who is on the graph meanwhile.

    By a node that nobody asks for anything, and which ``ros2 node list`` does not show. Those that
    are made meanwhile know what was found.
    """
    global _begun
    node = Node(
        f'_{name}_loading',
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )
    _begun = time.monotonic()
    try:
        yield
    except Exception:
        stop_receiving()  # it may be the last
        raise
    finally:
        node.destroy_node()


def begun() -> float:
    """When discovery began in this process [s, monotonic]: now, where it begins with the node."""
    return time.monotonic() if _begun is None else _begun
