"""The policy for SROS 2 says of every node what its interface says, and no more."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest

from maglev_controller.node import ControllerNode
from maglev_hw_bridge.node import BridgeNode
from maglev_monitor.bag.recorder import RecorderNode
from maglev_monitor.live.node import MonitorNode
from maglev_node.node import MaglevNode
from maglev_node.topics import CURRENTS, REFERENCE
from maglev_plant.node import PlantNode
from maglev_reference.node import ReferenceNode
from maglev_view.node import ViewNode
from maglev_view.web.calls import WISHES
from maglev_view.web.node import WebNode

POLICY = Path(__file__).resolve().parents[2] / 'params' / 'sros2' / 'policy.xml'
NODES: dict[str, type[MaglevNode]] = {
    'plant': PlantNode,
    'hw_bridge': BridgeNode,
    'controller': ControllerNode,
    'reference': ReferenceNode,
    'monitor': MonitorNode,
    'recorder': RecorderNode,
    'view': ViewNode,
    'web': WebNode,
}
ROOT = ElementTree.parse(POLICY).getroot()
PROFILES = {profile.get('node', ''): profile for profile in ROOT.iter('profile')}


def allowed(node: str, kind: str) -> set[str]:
    """What a node may ``publish``, ``subscribe``, ``reply`` to or ``request``."""
    return {
        str(name.text) for group in PROFILES[node] if group.get(kind) == 'ALLOW' for name in group
    }


def everything(node: str) -> set[str]:
    kinds = ('publish', 'subscribe', 'reply', 'request')
    return set().union(*(allowed(node, kind) for kind in kinds))


@pytest.mark.parametrize('node', NODES)
def test_a_node_may_do_what_its_interface_says(node: str) -> None:
    for name, text in NODES[node].interface.items():
        if text.startswith('published'):
            assert name in allowed(node, 'publish')
        elif text.startswith('subscribed'):
            assert name in allowed(node, 'subscribe')
        else:
            assert name in allowed(node, 'reply')


def test_only_the_controller_commands_and_only_operators_call() -> None:
    publishers = {node for node in PROFILES if CURRENTS in allowed(node, 'publish')}
    assert publishers == {'controller'}
    assert {node for node in PROFILES if REFERENCE in allowed(node, 'publish')} == {'reference'}
    assert {node for node in PROFILES if allowed(node, 'request')} == {'operator', 'web'}
    for node in PROFILES:
        assert not any('*' in name for kind in ('publish', 'reply') for name in allowed(node, kind))


def test_an_operator_may_call_every_service() -> None:
    for node in ('plant', 'hw_bridge', 'controller', 'reference'):
        for name in allowed(node, 'reply'):
            assert f'{node}/{name.removeprefix("~/")}' in allowed('operator', 'request')


def named(kind: str) -> set[str]:
    """What the nodes' interfaces say is ``published`` or ``subscribed``, in their namespace."""
    return {
        name.replace('~', node)
        for node, described in NODES.items()
        for name, text in described.interface.items()
        if text.startswith(kind)
    }


def test_an_operator_hears_what_is_published_and_says_what_nobody_else_does() -> None:
    assert named('published') <= allowed('operator', 'subscribe')
    said = set().union(*(allowed(node, 'publish') for node in PROFILES))
    assert named('subscribed') - said == set()


def test_all_but_what_ros_has_once_for_all_moves_with_the_namespace() -> None:
    absolute = {name for node in PROFILES for name in everything(node) if name.startswith('/')}
    assert absolute == {'/parameter_events', '/rosout'}


def test_the_page_may_call_what_its_buttons_need_and_nothing_else() -> None:
    nodes = {CURRENTS: ('controller',), REFERENCE: ('reference',)}
    needed = {
        f'{node}/{call.service}'
        for wish in WISHES.values()
        for call in wish.calls
        for node in nodes.get(call.topic, ('plant', 'hw_bridge'))
    }
    assert allowed('web', 'request') == needed
    assert needed <= allowed('operator', 'request')


def test_every_node_has_an_enclave() -> None:
    enclaves = {
        profile.get('node'): enclave.get('path')
        for enclave in ROOT.iter('enclave')
        for profile in enclave.iter('profile')
    }
    assert set(enclaves) == {*NODES, 'operator'}
    assert enclaves['plant'] == enclaves['hw_bridge']
    assert enclaves['web'] == enclaves['operator']
    assert len(set(enclaves.values())) == 5
