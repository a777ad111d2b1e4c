"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes


def controller() -> None:
    """Entry point of the executable ``controller``."""
    run_nodes('controller', 'maglev_controller.node:ControllerNode')


if __name__ == '__main__':
    controller()
