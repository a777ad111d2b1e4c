"""A trajectory on the fly as it comes: trajectory_msgs/JointTrajectory, serialized."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.serialization import deserialize_message
from trajectory_msgs.msg import JointTrajectory

from maglev_reference.check import UnreachableError
from maglev_reference.given_points import Point

_LONGEST = 100_000  # [bytes], which are read in less time than is published ahead


def read(data: bytes) -> tuple[Sequence[str], list[Point]]:
    """Joint names and points. Raises UnreachableError for what is too long or no such message."""
    if len(data) > _LONGEST:
        raise UnreachableError(
            f'the message has {len(data)} bytes, it must have at most {_LONGEST}: give fewer'
            ' points, they are joined by quintics'
        )
    try:
        message = deserialize_message(data, JointTrajectory)
    except RuntimeError as error:  # which rclpy's are
        raise UnreachableError('the message is no trajectory_msgs/JointTrajectory') from error
    if message.header.stamp.sec or message.header.stamp.nanosec:
        raise UnreachableError('header.stamp must be 0: it starts at once')
    return message.joint_names, [_point(each) for each in message.points]


def _point(given: Any) -> Point:
    time = given.time_from_start.sec + 1e-9 * given.time_from_start.nanosec
    return Point(time, given.positions, given.velocities, given.accelerations)
