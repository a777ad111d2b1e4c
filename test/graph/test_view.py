"""The view node over real DDS: what it publishes of a stage, in a namespace."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from graph import Nodes, Observer, executable
from paper_motor import vertical_force
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from maglev_model.geometry import motor_gaps
from maglev_model.machine import MachineParameters, machine_constants
from maglev_msgs.msg import ControllerState, Currents, Measurement
from maglev_node.polling import PolledSubscription
from maglev_node.stamp import nanoseconds, set_stamp
from maglev_node.topics import CONTROLLER_STATE, CURRENTS, MEASUREMENT, sample_qos
from maglev_view.frames import JOINTS, joint_transform, mounts, platen_pose
from maglev_view.node import (
    DESCRIPTION,
    JOINT_STATES,
    MARKERS,
    NEEDS,
    REFERENCE_PATH,
    REFERENCE_POSE,
    STAGE_POSE,
    TF,
    TF_STATIC,
)
from maglev_view.urdf import description

MACHINE = MachineParameters()
REFERENCE_OFF = np.array([1e-4, -2e-4, 3e-4, 1e-5, -1e-5])
"""By how much the made-up controller's errors are off."""


@pytest.fixture
def watching() -> Iterator[Observer]:
    """The stage, the controller and who looks at the view, all in a namespace."""
    made = Observer(namespace='/lab')
    yield made
    made.close()


class MadeUpStage:
    """Publishes samples of a platen that moves in all axes."""

    def __init__(self, node: Any) -> None:
        kinds = {MEASUREMENT: Measurement, CURRENTS: Currents, CONTROLLER_STATE: ControllerState}
        self._publishers = {
            topic: node.create_publisher(kind, topic, sample_qos(64))
            for topic, kind in kinds.items()
        }
        self._messages = {topic: kind() for topic, kind in kinds.items()}
        self.sequence = -1

    @staticmethod
    def outputs(stamp: int) -> np.ndarray:
        """Where the platen is at a stage time [ns]."""
        phase = 2e-9 * stamp
        turned = np.sin(phase), np.sin(phase + 1.0), np.sin(phase + 2.0)
        return np.array(
            [
                0.024 + 0.002 * turned[0],
                *(0.02 * s for s in turned[1:]),
                *(0.002 * s for s in turned[:2]),
            ]
        )

    def listeners(self) -> dict[str, int]:
        """How many listen to each topic."""
        return {t: publisher.get_subscription_count() for t, publisher in self._publishers.items()}

    def sample(self) -> None:
        """Publish one sample."""
        self.sequence += 1
        stamp = 1_000_000 * self.sequence
        outputs = self.outputs(stamp)
        for message in self._messages.values():
            message.sequence = self.sequence
            set_stamp(message.header.stamp, stamp)
        measured, currents, state = self._messages.values()
        measured.gap = motor_gaps(outputs, MACHINE.radius)
        measured.x, measured.z = float(outputs[1]), float(outputs[2])
        currents.direct_current = np.array([-0.2, 0.0, 3.5, 7.0])
        state.position, state.error = outputs, REFERENCE_OFF
        for topic, publisher in self._publishers.items():
            publisher.publish(self._messages[topic])


def test_standard_topics_in_a_namespace(nodes: Nodes, watching: Observer) -> None:
    stage = MadeUpStage(watching.node)
    command = [executable('maglev_view', 'view'), '--ros-args', '-r', '__ns:=/lab']
    view = nodes.run('view', command)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    fixed = watching.node.poll(TF_STATIC, TFMessage, latched)
    described = watching.node.poll(DESCRIPTION, String, latched)
    found: dict[str, list[Any]] = {topic: [] for topic in (*NEEDS, TF_STATIC, DESCRIPTION)}
    taps: dict[str, PolledSubscription] = {TF_STATIC: fixed, DESCRIPTION: described}

    def look() -> None:
        for topic, tap in taps.items():
            found[topic] += [message for message, _ in tap.take()]

    def latched_came() -> bool:
        look()
        return bool(found[TF_STATIC] and found[DESCRIPTION])

    watching.wait(latched_came)
    assert set(stage.listeners().values()) == {0}, 'it listens while nobody watches it'
    taps |= {topic: watching.node.poll(topic, kind) for topic, (kind, _) in NEEDS.items()}

    def all_came() -> bool:
        for _ in range(10):
            stage.sample()
        look()
        return min(len(found[topic]) for topic in NEEDS if topic != REFERENCE_PATH) >= 5 and bool(
            found[REFERENCE_PATH]
        )

    watching.wait(all_came)
    fine = {topic: find for topic, find in found.items() if topic in (JOINT_STATES, TF, STAGE_POSE)}
    judge_stage(fine)
    judge_reference(found)
    judge_forces(found[MARKERS])
    assert found[DESCRIPTION][0].data == description(MACHINE)
    frames = {t.child_frame_id: t.header.frame_id for t in found[TF_STATIC][0].transforms}
    assert frames == {mount.child: mount.parent for mount in mounts(MACHINE)}
    for topic in NEEDS:
        taps.pop(topic).destroy()
    watching.wait(lambda: set(stage.listeners().values()) == {0})
    assert view.running, view.output


def judge_stage(found: dict[str, list[Any]]) -> None:
    """All three tell where the platen was, once in each 20 ms of stage time."""
    for topic, messages in found.items():
        headers = [m.transforms[0].header if topic == TF else m.header for m in messages]
        stamps = [nanoseconds(header.stamp) for header in headers]
        assert len({stamp // 20_000_000 for stamp in stamps}) == len(stamps), topic
    for message in found[JOINT_STATES]:
        outputs = MadeUpStage.outputs(nanoseconds(message.header.stamp))
        assert message.name == ['y', 'x', 'z', 'phi', 'theta']
        assert message.position == pytest.approx(outputs, abs=1e-9)
    for message in found[TF]:
        outputs = MadeUpStage.outputs(nanoseconds(message.transforms[0].header.stamp))
        for joint, transform in zip(JOINTS, message.transforms, strict=True):
            assert (transform.header.frame_id, transform.child_frame_id) == (
                *(joint.parent, joint.child),
            )
            position, turned = joint_transform(joint, outputs[joint.output])
            shift, rotation = transform.transform.translation, transform.transform.rotation
            assert (shift.x, shift.y, shift.z) == pytest.approx(position, abs=1e-9)
            quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
            assert quaternion == pytest.approx(turned, abs=1e-9)
    for message in found[STAGE_POSE]:
        check_pose(message, MadeUpStage.outputs(nanoseconds(message.header.stamp)))


def check_pose(message: Any, outputs: np.ndarray) -> None:
    """A pose is that of a platen at these outputs."""
    position, turned = platen_pose(outputs)
    place, rotation = message.pose.position, message.pose.orientation
    assert message.header.frame_id == 'stage_link'
    assert (place.x, place.y, place.z) == pytest.approx(position, abs=1e-9)
    quaternion = (rotation.x, rotation.y, rotation.z, rotation.w)
    assert quaternion == pytest.approx(turned, abs=1e-9)


def judge_reference(found: dict[str, list[Any]]) -> None:
    """The reference is the position without its error; its path goes through what it was."""
    for message in (*found[REFERENCE_POSE], *found[REFERENCE_PATH][-1].poses):
        outputs = MadeUpStage.outputs(nanoseconds(message.header.stamp))
        check_pose(message, outputs - REFERENCE_OFF)


def judge_forces(found: list[Any]) -> None:
    """An arrow for each motor, as long as its force, and red where its current is at the limit."""
    constants = machine_constants(MACHINE)
    for message in found:
        assert [marker.id for marker in message.markers] == [1, 2, 3, 4]
        outputs = MadeUpStage.outputs(nanoseconds(message.markers[0].header.stamp))
        gaps = motor_gaps(outputs, MACHINE.radius)
        for marker, gap, i_d in zip(message.markers, gaps, (-0.2, 0.0, 3.5, 7.0), strict=True):
            start, tip = marker.points
            pull = -vertical_force(constants, gap, i_d, 0.0)
            assert tip.z - start.z == pytest.approx(4e-3 * pull, abs=1e-9)
            assert -start.z == pytest.approx(gap, abs=1e-7)
        colours = [marker.color for marker in message.markers]
        assert colours[1].b > colours[1].r
        assert colours[3].r > colours[3].b
