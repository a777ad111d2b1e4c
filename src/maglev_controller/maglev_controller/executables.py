"""What ``ros2 run maglev_controller`` runs: nodes, by where they are, which is loaded last."""

from __future__ import annotations

from maglev_node.process import main


def controller() -> None:
    """Entry point of the executable ``controller``."""
    main('controller', 'maglev_controller.node:ControllerNode')


if __name__ == '__main__':
    controller()
