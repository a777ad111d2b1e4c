"""The packages that need no ROS import none, directly or through what they import."""

from __future__ import annotations

import pytest
from source_tree import PACKAGES, PURE, imported, modules, top_level

NODES = {
    'maglev_controller.executables',
    'maglev_controller.node',
    'maglev_monitor.bag.recorder',
    'maglev_monitor.executables',
    'maglev_monitor.live.node',
    'maglev_plant.executables',
    'maglev_plant.node',
    'maglev_reference.executables',
    'maglev_reference.node',
    'maglev_view.executables',
    'maglev_view.messages',
    'maglev_view.node',
    'maglev_view.web.calls',
    'maglev_view.web.node',
}
"""The only modules of these packages that stand on ROS."""

ROS = ('rclpy', 'maglev_node', 'ament_index_python', 'rosidl_runtime_py')

ALL = {name: path for package in PACKAGES for name, path in modules(package).items()}


def is_ros(name: str) -> bool:
    """Whether a package is one of ROS, or of messages."""
    return name in ROS or name.endswith(('_msgs', '_srvs', '_interfaces'))


def closure(module: str) -> set[str]:
    """All that is imported with a module, the packages its parts lie in included."""
    found: set[str] = set()
    queue = [module]
    while queue:
        parts = queue.pop().split('.')
        for end in range(1, len(parts) + 1):
            name = '.'.join(parts[:end])
            if name not in found:
                found.add(name)
                if name in ALL:
                    queue += imported(ALL[name])
    return found


def ros_within(module: str) -> set[str]:
    """The packages of ROS that come with a module."""
    return {name for name in top_level(closure(module)) if is_ros(name)}


@pytest.mark.parametrize('package', [*PURE, 'maglev_view'])
def test_no_ros(package: str) -> None:
    found = {name: ros_within(name) for name in modules(package) if name not in NODES}
    assert {name: sorted(ros) for name, ros in found.items() if ros} == {}


@pytest.mark.parametrize('module', sorted(NODES))
def test_nodes_stand_on_ros(module: str) -> None:
    """Lest the list grow old, and the search blind."""
    assert ros_within(module)
