"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes


def plant() -> None:
    """Entry point of the executable ``plant``."""
    run_nodes('plant', 'maglev_plant.node:PlantNode')


if __name__ == '__main__':
    plant()
