"""What ``ros2 run maglev_reference`` runs: nodes, by where they are, which is loaded last."""

from __future__ import annotations

from maglev_node.process import main


def reference() -> None:
    """Entry point of the executable ``reference``."""
    main('reference', 'maglev_reference.node:ReferenceNode')


if __name__ == '__main__':
    reference()
