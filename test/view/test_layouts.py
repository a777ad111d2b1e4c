"""What the layouts for RViz, Foxglove and PlotJuggler name is there."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
import yaml

from maglev_model.axes import AXES
from maglev_model.machine import MachineParameters
from maglev_node.topics import DIAGNOSTICS
from maglev_view.frames import JOINTS, WORLD, mounts
from maglev_view.node import JOINT_STATES, REFERENCE_POSE, STAGE_POSE, ViewNode

LAYOUTS = Path(__file__).resolve().parents[2] / 'params' / 'layouts'
RVIZ, FOXGLOVE, PLOTJUGGLER = 'maglev.rviz', 'maglev_foxglove.json', 'maglev_plotjuggler.xml'

TOPICS = {
    f'/{topic}' for topic, text in ViewNode.interface.items() if text.startswith('published')
} | {f'/{DIAGNOSTICS}'}
FRAMES = {WORLD, *(each.child for each in (*mounts(MachineParameters()), *JOINTS))}


def leaves(tree: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """The keys and values of a document, by the keys above them."""
    if isinstance(tree, dict):
        for key, value in tree.items():
            yield (*path, str(key)), value
            yield from leaves(value, (*path, str(key)))
    elif isinstance(tree, list):
        for value in tree:
            yield from leaves(value, path)


def rviz() -> dict[tuple[str, ...], Any]:
    return dict(leaves(yaml.safe_load((LAYOUTS / RVIZ).read_text())))


def foxglove() -> Any:
    return json.loads((LAYOUTS / FOXGLOVE).read_text())


def words(name: str) -> set[str]:
    """All strings in a layout that look like topics."""
    return set(re.findall(r'["\' ](/[a-z][a-z_/.\[\]0-9]*)', (LAYOUTS / name).read_text()))


@pytest.mark.parametrize('name', [RVIZ, FOXGLOVE, PLOTJUGGLER])
def test_topics_exist(name: str) -> None:
    found = {word.split('.')[0] for word in words(name)}
    named = {topic for topic in TOPICS if any(f'{w}/'.startswith(f'{topic}/') for w in found)}
    strange = {w for w in found if not any(f'{w}/'.startswith(f'{topic}/') for topic in TOPICS)}
    assert strange == set()
    assert len(named) >= 3


def test_rviz_frames_exist() -> None:
    document = leaves(yaml.safe_load((LAYOUTS / RVIZ).read_text()))
    fixed = {
        value
        for path, value in document
        if path[-1] in ('Fixed Frame', 'Target Frame', 'Reference Frame')
    }
    shown = {path[-1] for path in rviz() if path[-2:-1] == ('Frames',)} - {'All Enabled'}
    assert fixed == {WORLD}
    assert shown <= FRAMES
    assert shown


def test_foxglove_frames_exist() -> None:
    stage = foxglove()['configById']['3D!stage']
    shown = {name.removeprefix('frame:') for name in stage['transforms']}
    assert shown | {stage['followTf'], stage['layers']['floor']['frameId']} <= FRAMES


def test_foxglove_shows_every_panel_it_has() -> None:
    panels = {value for _, value in leaves(foxglove()['layout']) if isinstance(value, str)}
    assert panels - {'row', 'column'} == set(foxglove()['configById'])


def test_curves_are_fields_of_messages() -> None:
    """As Foxglove (``topic.field``) and PlotJuggler (``topic/field``) write them."""
    pose = r'pose\.position\.[xyz]'
    for panel in foxglove()['configById'].values():
        for path in panel.get('paths', []):
            topic, _, field = path['value'].partition('.')
            wanted = r'position\[[0-4]\]' if topic == f'/{JOINT_STATES}' else pose
            assert re.fullmatch(wanted, field), path['value']
    root = ElementTree.parse(LAYOUTS / PLOTJUGGLER).getroot()
    curves = {curve.get('name', '') for curve in root.iter('curve')}
    taken = {topic.get('name', '') for topic in root.iter('topic')}
    joints = {f'/{JOINT_STATES}/{axis}/position' for axis in AXES}
    poses = {f'/{topic}/pose/position/{a}' for topic in (STAGE_POSE, REFERENCE_POSE) for a in 'xyz'}
    assert curves <= joints | poses
    assert all(any(curve.startswith(f'{topic}/') for topic in taken) for curve in curves)


def test_rviz_takes_what_is_latched_as_such() -> None:
    assert rviz()[
        ('Visualization Manager', 'Displays', 'Description Topic', 'Durability Policy')
    ] == ('Transient Local')
