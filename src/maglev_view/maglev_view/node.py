"""The view node: the stage on topics that RViz, Foxglove and PlotJuggler understand."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from maglev_model.axes import FloatArray
from maglev_model.geometry import outputs_of_gaps
from maglev_node.graph_guard import GraphGuard
from maglev_node.node import MaglevNode, NodeParameters
from maglev_node.polling import PolledSubscription
from maglev_node.stamp import nanoseconds
from maglev_node.topics import CONTROLLER_STATE, CURRENTS, MEASUREMENT, SAMPLE_TOPICS
from maglev_view import messages
from maglev_view.decimation import Decimation
from maglev_view.frames import mounts, platen_pose
from maglev_view.parameters import ViewParameters
from maglev_view.track import Track
from maglev_view.urdf import description

if TYPE_CHECKING:
    from maglev_view.forces import Forces

JOINT_STATES = 'joint_states'
TF, TF_STATIC = 'tf', 'tf_static'
DESCRIPTION = 'robot_description'
STAGE_POSE = 'stage/pose'
MARKERS = 'stage/markers'
REFERENCE_POSE = 'reference/pose'
REFERENCE_PATH = 'reference/path'

NEEDS: dict[str, tuple[type, tuple[str, ...]]] = {
    JOINT_STATES: (JointState, (MEASUREMENT,)),
    TF: (TFMessage, (MEASUREMENT,)),
    STAGE_POSE: (PoseStamped, (MEASUREMENT,)),
    MARKERS: (MarkerArray, (MEASUREMENT, CURRENTS)),
    REFERENCE_POSE: (PoseStamped, (CONTROLLER_STATE,)),
    REFERENCE_PATH: (Path, (CONTROLLER_STATE,)),
}
"""What is published of samples, with its type and the topics it is made of."""

_LOOK_PERIOD = 0.5  # between two looks at who subscribes, wall clock [s]
_POLL_PERIOD = 0.005  # between two looks at what has come, wall clock [s]

# Nobody waits for a view, or repeats for it
_NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ViewNodeParameters(NodeParameters, ViewParameters):
    """The view's parameters."""


class ViewNode(MaglevNode[ViewNodeParameters]):
    """Publishes the stage as joints, frames, poses and markers of the standard packages.

    A watcher that the loop does not know: it takes the newest sample when it comes to it, and
    subscribes to nothing while nobody subscribes to what it publishes.
    """

    interface: ClassVar[Mapping[str, str]] = {
        JOINT_STATES: 'published: y, x, z, phi, theta as measured',
        TF: 'published: from stage_paper to theta_link',
        TF_STATIC: 'published: the fixed frames, once',
        DESCRIPTION: 'published: the URDF of the machine, once',
        STAGE_POSE: 'published: the platen as measured, in stage_link',
        MARKERS: 'published: the force of each motor, coloured by its current',
        REFERENCE_POSE: 'published: where the platen shall be, in stage_link',
        REFERENCE_PATH: 'published: where it should have been before',
        **dict.fromkeys((MEASUREMENT, CURRENTS, CONTROLLER_STATE), 'subscribed: the newest sample'),
    }

    def __init__(self) -> None:
        super().__init__('view', ViewNodeParameters)
        GraphGuard(self).claim(STAGE_POSE, 'view')
        taken = self.parameters
        self._outlets = {
            topic: self.create_publisher(kind, topic, 10) for topic, (kind, _) in NEEDS.items()
        }
        self._taps: dict[str, PolledSubscription] = {}
        self._newest: dict[str, Any] = {}
        self._frames = messages.MovingFrames()
        self._poses, self._references = Decimation(taken.rate), Decimation(taken.rate)
        self._markers = Decimation(taken.marker_rate)
        self._paths = Decimation(1.0 / taken.path_period)
        self._track: Track[PoseStamped] = Track(taken.path_points, taken.path_step)
        self._describe()
        self._polling = self.create_timer(_POLL_PERIOD, self._poll, clock=self.steady_clock)
        self._polling.cancel()
        self.create_timer(_LOOK_PERIOD, self._look, clock=self.steady_clock)

    def diagnose(self) -> tuple[bytes, str, Mapping[str, object]]:
        """Whether anybody watches."""
        return DiagnosticStatus.OK, 'publishing' if self._taps else 'nobody subscribes', {}

    def _describe(self) -> None:
        """Publish what does not change, for whoever comes."""
        machine = self.parameters.machine
        self._fixed = self.create_publisher(TFMessage, TF_STATIC, _LATCHED)
        self._fixed.publish(messages.fixed_frames(self.get_clock().now().to_msg(), mounts(machine)))
        self._described = self.create_publisher(String, DESCRIPTION, _LATCHED)
        self._described.publish(String(data=description(machine)))

    def _wanted(self, topic: str) -> bool:
        return bool(self._outlets[topic].get_subscription_count())

    def _look(self) -> None:
        """Subscribe to what those need who subscribe to us, and to nothing else."""
        needed = {source for topic in NEEDS if self._wanted(topic) for source in NEEDS[topic][1]}
        for topic in needed - set(self._taps):
            self._taps[topic] = self.poll(topic, SAMPLE_TOPICS[topic], _NEWEST)
        for topic in set(self._taps) - needed:
            self._taps.pop(topic).destroy()
            self._newest.pop(topic, None)
        if needed and self._polling.is_canceled():
            self._polling.reset()
        elif not needed:
            self._polling.cancel()

    def _poll(self) -> None:
        for topic, tap in self._taps.items():
            for message, _ in tap.take(1):
                self._newest[topic] = message
                if topic == MEASUREMENT:
                    self._show_stage(message)
                elif topic == CONTROLLER_STATE:
                    self._show_reference(message)

    def _show_stage(self, measured: Any) -> None:
        stamp = measured.header.stamp
        time = nanoseconds(stamp)
        shown, marked = self._poses.due(time), self._markers.due(time)
        if not shown and not marked:
            return
        outputs = outputs_of_gaps(
            np.asarray(measured.gap), measured.x, measured.z, self.parameters.machine.radius
        )
        if not np.isfinite(outputs).all():
            return
        if shown and self._wanted(JOINT_STATES):
            self._outlets[JOINT_STATES].publish(messages.joint_states(stamp, outputs))
        if shown and self._wanted(TF):
            self._outlets[TF].publish(self._frames.at(stamp, outputs))
        if shown and self._wanted(STAGE_POSE):
            self._outlets[STAGE_POSE].publish(messages.pose(stamp, outputs))
        if marked and self._wanted(MARKERS) and CURRENTS in self._newest:
            self._show_forces(stamp, outputs, self._newest[CURRENTS])

    def _show_forces(self, stamp: Any, outputs: FloatArray, currents: Any) -> None:
        forces = self._forces.at(
            outputs, np.asarray(currents.direct_current), np.asarray(currents.quadrature_current)
        )
        scale, limit = self.parameters.force_scale, self.parameters.peak_current
        self._outlets[MARKERS].publish(messages.arrows(stamp, forces, scale, limit))

    @functools.cached_property
    def _forces(self) -> Forces:
        # Brings Numba, which takes longer than the node itself, so only when it is looked at.
        from maglev_view.forces import Forces

        return Forces(self.parameters.machine)

    def _show_reference(self, state: Any) -> None:
        stamp = state.header.stamp
        time = nanoseconds(stamp)
        if not self._references.due(time):
            return
        reference = np.asarray(state.position) - np.asarray(state.error)
        if not np.isfinite(reference).all():
            return
        if self._wanted(REFERENCE_POSE):
            self._outlets[REFERENCE_POSE].publish(messages.pose(stamp, reference))
        if self._wanted(REFERENCE_PATH):
            where, _ = platen_pose(reference)
            self._track.add(where, lambda: messages.pose(stamp, reference))
            if self._paths.due(time):
                self._outlets[REFERENCE_PATH].publish(messages.path(stamp, self._track.points))
