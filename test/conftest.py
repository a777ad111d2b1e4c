"""Tests that run side by side do not meet on the graph."""

from __future__ import annotations

import os

_worker = os.environ.get('PYTEST_XDIST_WORKER', 'gw0').removeprefix('gw')
_domains = os.environ.get('MAGLEV_TEST_DOMAINS', '').split()
if _domains:
    os.environ['ROS_DOMAIN_ID'] = _domains[int(_worker) % len(_domains)]
