"""The first that a node's process imports: signals are heard before all that takes its time."""

from __future__ import annotations

import importlib
import sys
from typing import Any

from maglev_model.programs.command import open_streams
from maglev_node import signals


def run_nodes(
    name: str, *nodes: str | type[Any], background: bool = False, suspends: bool = True
) -> None:
    """Entry point of an executable: run its nodes and leave with their exit code.

    Each is a class, or ``package.module:Class``, which is then imported when the process is on the
    graph already. With ``--help`` or ``-h`` it only says what they are. Nodes in the background
    yield to those of the loop when they want the same core. Several are for what only watches:
    those of the loop take their real-time priority, and land, each in a process of its own.
    What must not stand still is one that never ``suspends``: Ctrl-Z and Ctrl-\\ end it, as Ctrl-C
    does.
    A signal while the rest is imported, for a third of a second, ends the nodes in order as soon as
    they are there.
    """
    open_streams()
    asked = {'-h', '--help'} & set(sys.argv[1:])
    caught = [] if asked else signals.listen(suspends)
    process = importlib.import_module('maglev_node.process')
    if asked:
        process.say_help(name, *nodes)
    else:
        process.main(name, caught, *nodes, background=background)
