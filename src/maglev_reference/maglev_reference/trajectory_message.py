"""What a trajectory on the fly, trajectory_msgs/JointTrajectory, may be and holds; without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from maglev_reference.check import UnreachableError
from maglev_reference.given_points import Point

_LONGEST = 100_000  # [bytes], which are read in less time than is published ahead


def check_length(length: int) -> None:
    """Refuse a serialized message of that many bytes; raises UnreachableError."""
    if length > _LONGEST:
        raise UnreachableError(
            f'the message has {length} bytes, it must have at most {_LONGEST}: give fewer points,'
            ' they are joined by quintics'
        )


def joints_and_points(message: Any) -> tuple[Sequence[str], list[Point]]:
    """Joint names and points. Raises UnreachableError where it is to start later."""
    if message.header.stamp.sec or message.header.stamp.nanosec:
        raise UnreachableError('header.stamp must be 0: it starts at once')
    return message.joint_names, [_point(each) for each in message.points]


def _point(given: Any) -> Point:
    time = given.time_from_start.sec + 1e-9 * given.time_from_start.nanosec
    return Point(time, given.positions, given.velocities, given.accelerations)
