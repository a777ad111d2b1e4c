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
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as NavPath
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from maglev_model.axes import AXES
from maglev_model.machine import MachineParameters
from maglev_node.topics import DIAGNOSTICS
from maglev_view.frames import JOINTS, WORLD, mounts
from maglev_view.node import (
    DESCRIPTION,
    JOINT_STATES,
    NEEDS,
    REFERENCE_PATH,
    REFERENCE_POSE,
    STAGE_POSE,
    ViewNode,
)

LAYOUTS = Path(__file__).resolve().parents[2] / 'params' / 'layouts'
RVIZ, FOXGLOVE, PLOTJUGGLER = 'maglev.rviz', 'maglev_foxglove.json', 'maglev_plotjuggler.xml'

TOPICS = {
    f'/{topic}' for topic, text in ViewNode.interface.items() if text.startswith('published')
} | {f'/{DIAGNOSTICS}'}
FRAMES = {WORLD, *(each.child for each in (*mounts(MachineParameters()), *JOINTS))}
TYPES: dict[str, type] = {
    **{f'/{topic}': kind for topic, (kind, _) in NEEDS.items()},
    f'/{DESCRIPTION}': String,
}

RVIZ_DISPLAYS = {
    'rviz_default_plugins/Grid': None,
    'rviz_default_plugins/TF': None,
    'rviz_default_plugins/RobotModel': String,
    'rviz_default_plugins/MarkerArray': MarkerArray,
    'rviz_default_plugins/Path': NavPath,
    'rviz_default_plugins/Pose': PoseStamped,
}
"""As RViz of Jazzy names its displays, with what they take of a topic."""

FOXGLOVE_PANELS = {'3D', 'Plot', 'DiagnosticSummary'}
PLOTJUGGLER_SETTINGS = {
    'use_header_stamp',
    'discard_large_arrays',
    'max_array_size',
    'boolean_strings_to_number',
    'remove_suffix_from_strings',
    'selected_topics',
}


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
    named = {path[-1] for path in rviz() if path[-2:-1] == ('Frames',)} - {'All Enabled'}
    assert fixed == {WORLD}
    assert named == FRAMES  # RViz shows each that a layout does not switch off


def test_rviz_displays_exist_and_take_what_the_topic_is() -> None:
    manager = yaml.safe_load((LAYOUTS / RVIZ).read_text())['Visualization Manager']
    for display in manager['Displays']:
        taken = RVIZ_DISPLAYS[display['Class']]
        source = display.get('Topic') or display.get('Description Topic')
        assert taken == (TYPES[source['Value']] if source else None)


def test_foxglove_frames_exist() -> None:
    stage = foxglove()['configById']['3D!stage']
    named = {name.removeprefix('frame:') for name in stage['transforms']}
    assert named == FRAMES  # likewise
    assert {stage['followTf'], stage['layers']['floor']['frameId']} <= FRAMES


def test_foxglove_draws_nothing_larger_than_the_stage() -> None:
    """Its own defaults are for vehicles: lines 0.2 m wide, axes of 0.5 m."""
    topics = foxglove()['configById']['3D!stage']['topics']
    for topic, size in ((REFERENCE_PATH, 'lineWidth'), (REFERENCE_POSE, 'axisScale')):
        assert 0.0 < topics[f'/{topic}'][size] < MachineParameters().radius


def test_foxglove_shows_every_panel_it_has() -> None:
    panels = {value for _, value in leaves(foxglove()['layout']) if isinstance(value, str)}
    assert panels - {'row', 'column'} == set(foxglove()['configById'])
    assert {name.partition('!')[0] for name in panels - {'row', 'column'}} <= FOXGLOVE_PANELS


def test_plotjuggler_finds_its_plots_and_each_setting_of_its_streamer() -> None:
    """It takes a setting that is missing as no, or 0."""
    root = ElementTree.parse(LAYOUTS / PLOTJUGGLER).getroot()
    for splitter in root.iterfind('tabbed_widget/Tab/Container/DockSplitter'):
        count = len(splitter.findall('DockArea/plot'))
        assert splitter.get('count') == str(count)
        sizes = [float(size) for size in splitter.get('sizes', '').split(';')]
        assert sum(sizes) == pytest.approx(1.0, abs=1e-5)
        assert len(sizes) == count
    streamer = root.find('previouslyLoaded_Streamer')
    plugin = root.find('Plugins/plugin')
    assert streamer is not None
    assert plugin is not None
    assert streamer.get('name') == plugin.get('ID') == 'ROS2 Topic Subscriber'
    assert {each.tag for each in plugin} == PLOTJUGGLER_SETTINGS


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
