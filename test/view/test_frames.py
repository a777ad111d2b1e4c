"""The frames against (5), by the transforms and by the URDF, each gone through on its own."""

from __future__ import annotations

from itertools import product
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from maglev_model.geometry import motor_gaps
from maglev_model.machine import MachineParameters
from maglev_view.frames import (
    JOINTS,
    PLATEN,
    STAGE,
    joint_transform,
    motors,
    mounts,
    mover_position,
    platen_pose,
)
from maglev_view.parts import parts
from maglev_view.urdf import description

MACHINE = MachineParameters()
LOW, HIGH = np.array(MACHINE.lower_limit), np.array(MACHINE.upper_limit)
NEGLIGIBLE = 3e-8
"""What the order of the two tilts makes [m]."""

within_range = st.tuples(*(st.floats(a, b) for a, b in zip(LOW, HIGH, strict=True))).map(np.array)


def matrix(position: object, rotation: np.ndarray) -> np.ndarray:
    """A homogeneous transform."""
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = rotation, position
    return made


def of_quaternion(x: float, y: float, z: float, w: float) -> np.ndarray:
    """The rotation matrix of a quaternion."""
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """The rotation matrix about an axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def by_transforms(outputs: np.ndarray, machine: MachineParameters = MACHINE) -> dict:
    """Child and parent to transform, as ``tf`` and ``tf_static`` say it."""
    found = {}
    for mount in mounts(machine):
        half = 0.5 * mount.roll
        turned = of_quaternion(np.sin(half), 0.0, 0.0, np.cos(half))
        found[mount.child] = (mount.parent, matrix(mount.position, turned))
    for joint in JOINTS:
        position, quaternion = joint_transform(joint, outputs[joint.output])
        found[joint.child] = (joint.parent, matrix(position, of_quaternion(*quaternion)))
    return found


def numbers(text: str | None) -> np.ndarray:
    return np.array([float(word) for word in (text or '0 0 0').split()])


def by_urdf(outputs: np.ndarray, machine: MachineParameters = MACHINE) -> dict:
    """The same from the URDF and the names of the joints, as a robot_state_publisher makes it."""
    values = dict(zip(('y', 'x', 'z', 'phi', 'theta'), outputs, strict=True))
    found = {}
    for joint in ElementTree.fromstring(description(machine)).iter('joint'):
        origin, axis = joint.find('origin'), joint.find('axis')
        rpy = numbers(origin.get('rpy') if origin is not None else None)
        made = matrix(
            numbers(origin.get('xyz') if origin is not None else None),
            about([0, 0, 1], rpy[2]) @ about([0, 1, 0], rpy[1]) @ about([1, 0, 0], rpy[0]),
        )
        if axis is not None:
            along, value = numbers(axis.get('xyz')), values[joint.get('name', '')]
            turns = joint.get('type') == 'revolute'
            moved = (
                matrix(np.zeros(3), about(along, value))
                if turns
                else matrix(along * value, np.eye(3))
            )
            made = made @ moved
        found[joint.find('child').get('link')] = (joint.find('parent').get('link'), made)
    return found


def placed(frames: dict, child: str, within: str = STAGE) -> np.ndarray:
    """A frame in another one above it."""
    made = np.eye(4)
    while child != within:
        child, step = frames[child]
        made = step @ made
    return made


def gaps(frames: dict) -> list[float]:
    """How far below the face of its stator each mover is [m], motors 1 to 4."""
    return [
        placed(frames, f'stator_{n}')[2, 3] - placed(frames, f'mover_{n}')[2, 3]
        for n in (1, 2, 3, 4)
    ]


@pytest.mark.parametrize('frames', [by_transforms, by_urdf])
@given(outputs=within_range)
def test_the_gaps_are_those_of_5(frames, outputs: np.ndarray) -> None:
    expected = motor_gaps(outputs, MACHINE.radius)
    assert gaps(frames(outputs)) == pytest.approx(expected, abs=NEGLIGIBLE)


def test_at_the_ends_of_every_axis_too() -> None:
    for outputs in product(*zip(LOW, HIGH, strict=True)):
        expected = motor_gaps(np.array(outputs), MACHINE.radius)
        assert gaps(by_transforms(np.array(outputs))) == pytest.approx(expected, abs=NEGLIGIBLE)


@pytest.mark.parametrize(('output', 'column', 'sign'), [(1, 0, 1.0), (2, 1, 1.0), (0, 2, -1.0)])
def test_the_platen_goes_where_the_outputs_say(output: int, column: int, sign: float) -> None:
    """x along the world's x, z along its y, and a wider gap is further down."""
    start, moved = np.array([0.025, 0.0, 0.0, 0.0, 0.0]), np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    moved[output] += 0.004
    before, after = (placed(by_transforms(at), PLATEN)[:3, 3] for at in (start, moved))
    expected = np.zeros(3)
    expected[column] = 0.004 * sign
    np.testing.assert_allclose(after - before, expected, atol=1e-15)


@given(outputs=within_range)
def test_pose_and_frames_agree(outputs: np.ndarray) -> None:
    position, quaternion = platen_pose(outputs)
    frame = placed(by_transforms(outputs), PLATEN)
    np.testing.assert_allclose(matrix(position, of_quaternion(*quaternion)), frame, atol=1e-15)
    for motor in motors(MACHINE):
        frame = placed(by_transforms(outputs), motor.mover)
        np.testing.assert_allclose(mover_position(motor, outputs), frame[:3, 3], atol=1e-15)


def test_the_machine_with_one_motor() -> None:
    machine = MachineParameters(motors=1, mass_y=1.725, mass_x=5.3)
    frames = by_urdf(np.array([0.02, 0.01, 0.0, 0.0, 0.0]), machine)
    assert placed(frames, 'stator_2')[2, 3] - placed(frames, 'mover_2')[2, 3] == pytest.approx(0.02)
    assert {part.motor for part in parts(machine)} == {0, 2}


def test_the_urdf_has_table_1s_masses_and_inertias() -> None:
    robot = ElementTree.fromstring(description(MACHINE))
    masses = {
        link.get('name'): float(mass.get('value', 'nan'))
        for link in robot.iter('link')
        for mass in link.iter('mass')
    }
    assert masses[PLATEN] == 6.9
    assert masses[PLATEN] + masses['z_link'] == pytest.approx(8.6)
    assert sum(masses.values()) == pytest.approx(10.6)
    (inertia,) = (e for e in robot.iter('inertia') if float(e.get('ixx', '0')))
    assert inertia.get('ixx') == inertia.get('iyy') == '0.5268'
    limits = {joint.get('name'): joint.find('limit') for joint in robot.iter('joint')}
    assert (limits['y'].get('lower'), limits['y'].get('upper')) == ('0.018', '0.031')
    assert (limits['theta'].get('lower'), limits['theta'].get('upper')) == ('-0.014', '0.014')


def test_the_boxes_have_table_1s_dimensions() -> None:
    boxes = parts(MACHINE)
    low = np.min(
        [np.subtract(p.centre, np.multiply(0.5, p.size)) for p in boxes if p.frame == STAGE], axis=0
    )
    high = np.max(
        [np.add(p.centre, np.multiply(0.5, p.size)) for p in boxes if p.frame == STAGE], axis=0
    )
    np.testing.assert_allclose(high - low, (1.2, 1.2, 0.3))
    stator = next(p for p in boxes if p.frame == 'stator_2')
    assert stator.size[:2] == pytest.approx((18 * 19.05e-3, 0.05))
    assert stator.centre[2] - 0.5 * stator.size[2] == pytest.approx(0.0, abs=1e-12)
    magnets = [p for p in boxes if p.frame == 'mover_1' and p.size[2] == 0.005]
    assert len(magnets) == 4
    assert magnets[0].size == pytest.approx((0.05, 0.02858, 0.005))
    assert magnets[1].centre[1] - magnets[0].centre[1] == pytest.approx(0.05715)
    assert {p.centre[2] + 0.5 * p.size[2] for p in magnets} == {0.0}
