"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.process import main


def controller() -> None:
    """Entry point of the executable ``controller``."""
    main('controller', 'maglev_controller.node:ControllerNode')


if __name__ == '__main__':
    controller()
