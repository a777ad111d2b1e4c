"""Tests that run side by side do not meet on the graph; the longest files begin first."""

from __future__ import annotations

import os

import pytest

_worker = os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw')
_domains = os.environ.get('MAGLEV_TEST_DOMAINS', '').split()
if _domains:
    os.environ['ROS_DOMAIN_ID'] = _domains[int(_worker) % len(_domains)]


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Scenarios first, then the other tests with real nodes, which all take their time."""

    def place(item: pytest.Item) -> tuple[bool, bool]:
        return item.path.name != 'test_scenarios.py', item.path.parent.name != 'graph'

    items.sort(key=place)
