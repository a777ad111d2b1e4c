"""Recorder and monitor in one process, to which the loop sends what it publishes only once."""

from __future__ import annotations

from maglev_monitor.bag.recorder import RecorderNode
from maglev_monitor.live.node import MonitorNode
from maglev_node.process import main as run_main


def main() -> None:
    """Entry point of the executable."""
    run_main('watchers', RecorderNode, MonitorNode, background=True)


if __name__ == '__main__':
    main()
