"""What ``ros2 run maglev_plant`` runs: nodes, by where they are, which is loaded last."""

from __future__ import annotations

from maglev_node.process import main


def plant() -> None:
    """Entry point of the executable ``plant``."""
    main('plant', 'maglev_plant.node:PlantNode')


if __name__ == '__main__':
    plant()
