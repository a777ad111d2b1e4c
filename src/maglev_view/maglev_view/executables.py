"""Entry points of the nodes, each of which is imported when its process is on the graph."""

from __future__ import annotations

from maglev_node.process import main


def view() -> None:
    """Entry point of the executable ``view``."""
    main('view', 'maglev_view.node:ViewNode', background=True)


def web() -> None:
    """Entry point of the executable ``web``."""
    main('web', 'maglev_view.web.node:WebNode', background=True)
