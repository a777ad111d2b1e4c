"""Trajectory and step on the fly, over DDS, to real nodes: followed from a hover, or refused."""

from __future__ import annotations

import pytest
from flight import WATCHED
from graph import Nodes, Observer
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from maglev_msgs.srv import Step
from maglev_node.topics import REFERENCE, TRUE_STATE

HOVERING = ('trajectory:=hold', 'duration:=600.0', 'run_in:=0.0', 'move_time:=0.3')


def to_x(goal: float, seconds: int = 0) -> JointTrajectory:
    """A move of x in half a second, or so many more."""
    point = JointTrajectoryPoint(positions=[goal])
    point.time_from_start.sec, point.time_from_start.nanosec = seconds, 500_000_000
    return JointTrajectory(joint_names=['x'], points=[point])


def settles(watching: Observer, axis: int, goal: float) -> None:
    """Wait until half a second of stage time after the reference of an axis came to its goal."""
    watching.wait(lambda: watching.newest(REFERENCE).position[axis] == pytest.approx(goal))
    end = watching.newest(REFERENCE).sequence + 500
    watching.wait(lambda: watching.newest(TRUE_STATE).sequence > end)


def test_it_is_followed_from_the_hover_or_refused(nodes: Nodes, watching: Observer) -> None:
    nodes.start('plant', WATCHED, params=('benchmark.yaml',))
    nodes.start('controller', WATCHED)
    reference = nodes.start('reference', WATCHED, *HOVERING)
    reference.wait_for('TRACK at sample', timeout=180.0)
    publisher = watching.node.create_publisher(JointTrajectory, 'reference/trajectory', 1)
    watching.wait(lambda: publisher.get_subscription_count() == 1)
    publisher.publish(to_x(0.06))
    reference.wait_for('trajectory refused: unreachable reference: x is', timeout=60.0)
    longest = JointTrajectory(joint_names=['x'], points=4000 * to_x(0.01).points)
    publisher.publish(longest)
    reference.wait_for('trajectory refused: the message has', timeout=60.0)
    publisher.publish(b'\x00\x01\x00\x00')
    reference.wait_for('trajectory refused: the message is no trajectory_msgs', timeout=60.0)
    publisher.publish(to_x(0.01))
    reference.wait_for('following a trajectory of 0.5 s, then hovering', timeout=60.0)
    settles(watching, 1, 0.01)
    assert watching.newest(TRUE_STATE).state[2] == pytest.approx(0.01, abs=5e-5)
    client = watching.node.create_client(Step, 'reference/step')
    refused = watching.ask(client, Step.Request(axis='z', distance=0.055))
    assert not refused.success
    assert 'step refused: unreachable reference: z is 0.05' in refused.message
    taken = watching.ask(client, Step.Request(axis='y', distance=-0.001))
    assert taken.success
    assert taken.message == 'y steps in 0.2 s, then hovers'
    settles(watching, 0, 0.024)
    assert watching.newest(TRUE_STATE).state[0] == pytest.approx(0.024, abs=5e-5)
    assert watching.newest(TRUE_STATE).state[2] == pytest.approx(0.01, abs=5e-5)
    publisher.publish(to_x(0.0, seconds=3600))  # takes longer to check than the next to come
    assert publisher.wait_for_all_acked()
    assert watching.ask(client, Step.Request(axis='y', distance=0.001)).success
    reference.wait_for('refused: before it was checked another motion came', timeout=60.0)
    settles(watching, 0, 0.025)
    assert watching.newest(REFERENCE).position[1] == pytest.approx(0.01)
    assert watching.call('/reference/land').success
    reference.wait_for('END at sample', timeout=60.0)
