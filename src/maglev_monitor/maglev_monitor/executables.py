"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes

_MONITOR = 'maglev_monitor.live.node:MonitorNode'
_RECORDER = 'maglev_monitor.bag.recorder:RecorderNode'


def monitor() -> None:
    """Entry point of the executable ``monitor``."""
    run_nodes('monitor', _MONITOR)


def recorder() -> None:
    """Entry point of the executable ``recorder``."""
    run_nodes('recorder', _RECORDER)


def watchers() -> None:
    """Entry point of the executable ``watchers``: recorder and monitor in one process.

    To each of which the middleware then brings a message once.
    """
    run_nodes('watchers', _RECORDER, _MONITOR)
