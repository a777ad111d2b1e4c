"""The file with which ``ros2 bag record`` loses nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rosbags.interfaces import QosDurability, QosHistory, QosReliability

from maglev_node.topics import DIAGNOSTICS, REFERENCE, SAMPLE_TOPICS, reference_qos, sample_qos

FILE = Path(__file__).resolve().parents[2] / 'params' / 'rosbag2_qos.yaml'
POLICIES: dict[str, tuple[Any, Any]] = {
    'history': (HistoryPolicy, QosHistory),
    'reliability': (ReliabilityPolicy, QosReliability),
    'durability': (DurabilityPolicy, QosDurability),
}


def profiles() -> dict[str, QoSProfile]:
    """The file as ros2bag reads it: every policy by its short key, depth as a number."""
    found = {}
    for topic, policies in yaml.safe_load(FILE.read_text()).items():
        assert set(policies) == {*POLICIES, 'depth'}
        named = {}
        for name, (ours, theirs) in POLICIES.items():
            named[name] = ours.get_from_short_key(policies[name])
            assert theirs[policies[name].upper()].value == int(named[name])
        found[topic] = QoSProfile(depth=policies['depth'], **named)
    return found


def test_every_sample_topic_is_named_and_kept_for_seconds() -> None:
    found = profiles()
    assert set(found) == {f'/{topic}' for topic in (*SAMPLE_TOPICS, DIAGNOSTICS)}
    for topic in SAMPLE_TOPICS:
        offered = reference_qos() if topic == REFERENCE else sample_qos()
        wanted = found[f'/{topic}']
        assert wanted.depth >= 16384
        assert wanted.durability == offered.durability
        assert wanted.reliability == ReliabilityPolicy.RELIABLE
        assert qos_check_compatible(offered, wanted)[0] != QoSCompatibility.ERROR


def test_the_file_says_how_it_is_used() -> None:
    assert f'--qos-profile-overrides-path params/{FILE.name}' in FILE.read_text()
