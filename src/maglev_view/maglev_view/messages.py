"""What is shown, as messages of the standard packages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, PoseStamped, TransformStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from maglev_model.axes import AXES, FloatArray
from maglev_view.colours import colour_of
from maglev_view.frames import (
    JOINTS,
    STAGE,
    Mount,
    Quaternion,
    Vector,
    joint_transform,
    platen_pose,
)

if TYPE_CHECKING:
    from maglev_view.forces import Force

_SHAFT, _HEAD = 0.012, 0.03  # diameters of an arrow [m]


def joint_states(stamp: Time, outputs: FloatArray) -> JointState:
    """The five outputs (5,) [m, rad] as joints."""
    message = JointState(name=list(AXES), position=outputs.tolist())
    message.header.stamp = stamp
    return message


def fixed_frames(stamp: Time, mounts: Iterable[Mount]) -> TFMessage:
    """All frames that stay where they are, for ``tf_static``."""
    message = TFMessage()
    for mount in mounts:
        half = 0.5 * mount.roll
        turned = (math.sin(half), 0.0, 0.0, math.cos(half))
        transform = _transform(mount.parent, mount.child)
        _place(transform, stamp, mount.position, turned)
        message.transforms.append(transform)
    return message


class MovingFrames:
    """The frames between stage and platen, for ``tf``, in one message that is used again."""

    def __init__(self) -> None:
        transforms = [_transform(joint.parent, joint.child) for joint in JOINTS]
        self._message = TFMessage(transforms=transforms)

    def at(self, stamp: Time, outputs: FloatArray) -> TFMessage:
        """At outputs (5,) [m, rad]."""
        for joint, transform in zip(JOINTS, self._message.transforms, strict=True):
            _place(transform, stamp, *joint_transform(joint, float(outputs[joint.output])))
        return self._message


def pose(stamp: Time, outputs: FloatArray) -> PoseStamped:
    """The platen's pose in ``stage_link`` at outputs (5,) [m, rad]."""
    (x, y, z), (qx, qy, qz, qw) = platen_pose(outputs)
    message = PoseStamped()
    message.header.stamp = stamp
    message.header.frame_id = STAGE
    place, turned = message.pose.position, message.pose.orientation
    place.x, place.y, place.z = x, y, z
    turned.x, turned.y, turned.z, turned.w = qx, qy, qz, qw
    return message


def path(stamp: Time, poses: Iterable[PoseStamped]) -> Path:
    """Poses in ``stage_link`` as a path."""
    message = Path(poses=list(poses))
    message.header.stamp = stamp
    message.header.frame_id = STAGE
    return message


def arrows(stamp: Time, forces: Sequence[Force], scale: float, limit: float) -> MarkerArray:
    """The forces, ``scale`` [m/N] long, coloured by each motor's current over ``limit`` [A]."""
    return MarkerArray(markers=[_arrow(stamp, force, scale, limit) for force in forces])


def _arrow(stamp: Time, force: Force, scale: float, limit: float) -> Marker:
    tip = [a + scale * f for a, f in zip(force.position, force.newtons, strict=True)]
    marker = Marker(ns='force', id=force.motor.number, type=Marker.ARROW, action=Marker.ADD)
    marker.header.stamp = stamp
    marker.header.frame_id = STAGE
    marker.points = [_point(force.position), _point(tip)]
    marker.scale.x, marker.scale.y = _SHAFT, _HEAD
    marker.color.r, marker.color.g, marker.color.b = colour_of(force.current / limit)
    marker.color.a = 1.0
    marker.pose.orientation.w = 1.0
    return marker


def _point(where: Sequence[float]) -> Point:
    x, y, z = where
    return Point(x=x, y=y, z=z)


def _transform(parent: str, child: str) -> TransformStamped:
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id = parent
    return transform


def _place(message: Any, stamp: Time, position: Vector, turned: Quaternion) -> None:
    message.header.stamp = stamp
    shift, rotation = message.transform.translation, message.transform.rotation
    shift.x, shift.y, shift.z = position
    rotation.x, rotation.y, rotation.z, rotation.w = turned
