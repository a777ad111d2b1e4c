"""The stage's frames: from the paper's axes to those of REP-103, z up. No ROS here.

The paper's Y, the air gap, points down from the faces of the stators; its X is the world's x, its Z
the world's y. Both systems are right-handed: ``stage_paper`` is ``stage_link`` rolled by -90°. In
it the platen is carried as on the guides: X carries Z, which carries Y, then the tilts phi about X
and theta about Z. That gives the gaps of (5), with motors 1 to 4 at +Z, +X, -Z, -X; that theta
turns about an axis that phi has tilted makes up to 25 nm of difference.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from maglev_model.axes import AXES, PHI, THETA, FloatArray, X, Y, Z
from maglev_model.machine import MachineParameters

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""

WORLD, STAGE, PAPER, PLATEN = 'world', 'stage_link', 'stage_paper', 'platen_link'

FACE_HEIGHT = 0.21
"""Of the stators' faces above the world's floor [m]; as it is drawn, Table I has no such value."""


class Mount(NamedTuple):
    """A frame that is fixed in another: where [m], and rolled about x by how much [rad]."""

    child: str
    parent: str
    position: Vector = (0.0, 0.0, 0.0)
    roll: float = 0.0


class Joint(NamedTuple):
    """A frame that one output moves along or about an axis of its parent."""

    child: str
    parent: str
    axis: Vector
    output: int

    @property
    def name(self) -> str:
        """The name of its output."""
        return AXES[self.output]

    @property
    def turns(self) -> bool:
        """Whether it turns rather than slides."""
        return self.output in (PHI, THETA)


JOINTS = (
    Joint('x_link', PAPER, (1.0, 0.0, 0.0), X),
    Joint('z_link', 'x_link', (0.0, 0.0, 1.0), Z),
    Joint('y_link', 'z_link', (0.0, 1.0, 0.0), Y),
    Joint('phi_link', 'y_link', (1.0, 0.0, 0.0), PHI),
    Joint('theta_link', 'phi_link', (0.0, 0.0, 1.0), THETA),
)
"""What moves, from the frame to the platen."""


class Motor(NamedTuple):
    """A motor by its number: its centre on the frame [m], and which way along it i_q pushes."""

    number: int
    position: Vector
    direction: Vector

    @property
    def stator(self) -> str:
        """The frame in the middle of its stator's face."""
        return f'stator_{self.number}'

    @property
    def mover(self) -> str:
        """The frame in the middle of its magnets' faces."""
        return f'mover_{self.number}'


def motors(machine: MachineParameters) -> tuple[Motor, ...]:
    """The motors of a machine; the only one of a machine with one is in the middle."""
    r, along_x, along_z = machine.radius, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    if machine.motors == 1:
        return (Motor(2, (0.0, 0.0, 0.0), along_x),)
    return (
        Motor(1, (0.0, r, 0.0), along_z),
        Motor(2, (r, 0.0, 0.0), along_x),
        Motor(3, (0.0, -r, 0.0), along_z),
        Motor(4, (-r, 0.0, 0.0), along_x),
    )


def mounts(machine: MachineParameters) -> tuple[Mount, ...]:
    """All frames that are fixed in others."""
    return (
        Mount(STAGE, WORLD, (0.0, 0.0, FACE_HEIGHT)),
        Mount(PAPER, STAGE, roll=-0.5 * math.pi),
        Mount(PLATEN, JOINTS[-1].child, roll=0.5 * math.pi),
        *(Mount(motor.stator, STAGE, motor.position) for motor in motors(machine)),
        *(Mount(motor.mover, PLATEN, motor.position) for motor in motors(machine)),
    )


def joint_transform(joint: Joint, value: float) -> tuple[Vector, Quaternion]:
    """Where a joint's child is in its parent [m], at the value of its output [m, rad]."""
    x, y, z = joint.axis
    if not joint.turns:
        return (value * x, value * y, value * z), (0.0, 0.0, 0.0, 1.0)
    sine = math.sin(0.5 * value)
    return (0.0, 0.0, 0.0), (sine * x, sine * y, sine * z, math.cos(0.5 * value))


def platen_pose(outputs: FloatArray) -> tuple[Vector, Quaternion]:
    """Where the platen is in ``stage_link`` [m], from y, x, z, phi, theta (5,) [m, rad]."""
    y, x, z, phi, theta = (float(value) for value in outputs)
    sin_phi, cos_phi = math.sin(0.5 * phi), math.cos(0.5 * phi)
    sin_theta, cos_theta = math.sin(0.5 * theta), math.cos(0.5 * theta)
    turned = (sin_phi * cos_theta, cos_phi * sin_theta, sin_phi * sin_theta, cos_phi * cos_theta)
    return (x, z, -y), turned


def turn(quaternion: Quaternion, vector: Vector) -> Vector:
    """A vector, turned."""
    qx, qy, qz, qw = quaternion
    x, y, z = vector
    tx, ty, tz = 2.0 * (qy * z - qz * y), 2.0 * (qz * x - qx * z), 2.0 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )


def mover_position(motor: Motor, outputs: FloatArray) -> Vector:
    """The middle of a mover's magnets in ``stage_link`` [m], from outputs (5,) [m, rad]."""
    (x, y, z), turned = platen_pose(outputs)
    dx, dy, dz = turn(turned, motor.position)
    return (x + dx, y + dy, z + dz)
