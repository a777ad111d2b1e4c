"""Whichever tf2_msgs is used, its message is the one that the rest of Jazzy speaks."""

from __future__ import annotations

import json
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from rosbags.typesys import Stores, get_typestore

NAME = 'tf2_msgs/msg/TFMessage'


def test_the_type_has_jazzys_hash() -> None:
    described = Path(get_package_share_directory('tf2_msgs')) / 'msg' / 'TFMessage.json'
    hashes = json.loads(described.read_text())['type_hashes']
    ours = next(each['hash_string'] for each in hashes if each['type_name'] == NAME)
    store = get_typestore(Stores.ROS2_JAZZY)
    assert ours == f'RIHS01_{store.hash_rihs01(NAME).removeprefix("RIHS01_")}'
