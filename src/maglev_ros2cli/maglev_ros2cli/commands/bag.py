"""``ros2 bag``: bags; each verb is in a module of its own."""

from __future__ import annotations

from maglev_ros2cli.commands import bag_info, bag_play, bag_record
from maglev_ros2cli.parser import Parser, Verbs


def add(parser: Parser) -> None:
    verbs = Verbs(parser)
    bag_info.add(verbs)
    bag_play.add(verbs)
    bag_record.add(verbs)
