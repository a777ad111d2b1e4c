"""The stage in URDF, from the parameters of its machine. No ROS here."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from maglev_model.machine import MachineParameters
from maglev_view.frames import JOINTS, PLATEN, WORLD, mounts
from maglev_view.parts import Part, parts

_MOST = {'effort': '1000', 'velocity': '10'}  # which URDF wants; the model has no such limits


def description(machine: MachineParameters) -> str:
    """The URDF of a machine: frame, stators and platen with Table I's dimensions and inertias.

    The masses along the chain are those of (6): what X carries weighs M_x, what Z carries M_z, what
    Y carries M_y.
    """
    robot = Element('robot', name='maglev_stage')
    masses = _masses(machine)
    fixed = mounts(machine)
    boxes = parts(machine)
    for name in (WORLD, *(mount.child for mount in fixed), *(joint.child for joint in JOINTS)):
        link = SubElement(robot, 'link', name=name)
        _add_inertia(link, masses.get(name, 0.0), machine if name == PLATEN else None)
        for part in boxes:
            if part.frame == name:
                _add_box(link, part)
    for mount in fixed:
        joint = _add_joint(robot, f'{mount.child}_mount', 'fixed', mount.parent, mount.child)
        SubElement(joint, 'origin', xyz=_text(mount.position), rpy=_text((mount.roll, 0.0, 0.0)))
    for moved in JOINTS:
        kind = 'revolute' if moved.turns else 'prismatic'
        joint = _add_joint(robot, moved.name, kind, moved.parent, moved.child)
        SubElement(joint, 'axis', xyz=_text(moved.axis))
        low, high = machine.lower_limit[moved.output], machine.upper_limit[moved.output]
        SubElement(joint, 'limit', {'lower': repr(low), 'upper': repr(high), **_MOST})
    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding='unicode')


def _masses(machine: MachineParameters) -> dict[str, float]:
    """What each link adds to what it carries [kg]; where Table I leaves less than nothing, none."""
    return {
        'x_link': max(0.0, machine.mass_x - machine.mass_z),
        'z_link': max(0.0, machine.mass_z - machine.mass_y),
        PLATEN: machine.mass_y,
    }


def _add_inertia(link: Element, mass: float, turning: MachineParameters | None) -> None:
    """A point mass, or a flat platen, whose third inertia is the sum of the other two."""
    if not mass:
        return
    inertial = SubElement(link, 'inertial')
    SubElement(inertial, 'mass', value=repr(mass))
    moment = turning.inertia if turning else 0.0
    values = {'ixx': moment, 'iyy': moment, 'izz': 2.0 * moment, 'ixy': 0.0, 'ixz': 0.0, 'iyz': 0.0}
    SubElement(inertial, 'inertia', {name: repr(value) for name, value in values.items()})


def _add_box(link: Element, part: Part) -> None:
    visual = SubElement(link, 'visual')
    SubElement(visual, 'origin', xyz=_text(part.centre), rpy='0 0 0')
    SubElement(SubElement(visual, 'geometry'), 'box', size=_text(part.size))
    name = 'colour_' + '_'.join(f'{round(255 * value):02x}' for value in part.colour)
    material = SubElement(visual, 'material', name=name)
    SubElement(material, 'color', rgba=_text((*part.colour, 1.0)))


def _add_joint(robot: Element, name: str, kind: str, parent: str, child: str) -> Element:
    joint = SubElement(robot, 'joint', name=name, type=kind)
    SubElement(joint, 'parent', link=parent)
    SubElement(joint, 'child', link=child)
    return joint


def _text(values: Iterable[float]) -> str:
    return ' '.join(repr(float(value)) for value in values)
