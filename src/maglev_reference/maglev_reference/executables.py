"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes


def reference() -> None:
    """Entry point of the executable ``reference``."""
    run_nodes('reference', 'maglev_reference.node:ReferenceNode')


if __name__ == '__main__':
    reference()
