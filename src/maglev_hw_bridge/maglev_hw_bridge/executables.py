"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes


def hw_bridge() -> None:
    """Entry point of the executable ``hw_bridge``."""
    run_nodes('hw_bridge', 'maglev_hw_bridge.node:BridgeNode', suspends=False)


if __name__ == '__main__':
    hw_bridge()
