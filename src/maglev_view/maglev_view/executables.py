"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.executable import run_nodes


def view() -> None:
    """Entry point of the executable ``view``."""
    run_nodes('view', 'maglev_view.node:ViewNode', background=True)


def web() -> None:
    """Entry point of the executable ``web``."""
    run_nodes('web', 'maglev_view.web.node:WebNode', background=True)
