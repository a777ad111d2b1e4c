"""What ``ros2 run maglev_view`` runs: nodes, by where they are, which is loaded last."""

from __future__ import annotations

from maglev_node.process import main


def view() -> None:
    """Entry point of the executable ``view``."""
    main('view', 'maglev_view.node:ViewNode', background=True)


def web() -> None:
    """Entry point of the executable ``web``."""
    main('web', 'maglev_view.web.node:WebNode', background=True)
