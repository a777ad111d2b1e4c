"""``python -m maglev_ros2cli``: the executable ``ros2``."""

from maglev_ros2cli.cli import main

main()
