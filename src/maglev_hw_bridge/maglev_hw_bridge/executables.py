"""What ``ros2 run maglev_hw_bridge`` runs: nodes, by where they are, which is loaded last."""

from __future__ import annotations

from maglev_node.process import main


def hw_bridge() -> None:
    """Entry point of the executable ``hw_bridge``."""
    main('hw_bridge', 'maglev_hw_bridge.node:BridgeNode')


if __name__ == '__main__':
    hw_bridge()
