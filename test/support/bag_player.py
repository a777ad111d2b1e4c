"""Plays a bag as ``ros2 bag play`` does, found in the file alone.

Independent of what writes and analyses our bags: the file is read by the mcap project's own
reader, its messages are decoded by that project's ROS 2 decoder from the definitions in the file,
and rosbag2's record in it is read as rosbag2_storage's yaml.hpp and qos.cpp of Jazzy do.
"""

from __future__ import annotations

import importlib
import time
from pathlib import Path
from typing import Any

import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')
INFINITE = {'sec': 9223372036, 'nsec': 854775807}  # RMW_DURATION_INFINITE
DEPTH = 4096  # play keeps 10, and loses what a test machine that stands still does not take


def offered_qos(profiles: Any) -> QoSProfile:
    """What play offers for a topic: the recorded policies, with a history of its own."""
    assert isinstance(profiles, list)
    assert all(profile == profiles[0] for profile in profiles)
    profile = profiles[0]
    for name in DURATIONS:
        assert profile[name] in (INFINITE, {'sec': 10, 'nsec': 0} if name == 'lifespan' else None)
    assert type(profile['depth']) is int
    assert type(profile['avoid_ros_namespace_conventions']) is bool
    assert profile['history'] in ('keep_last', 'keep_all', 'system_default', 'unknown')
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=DEPTH,
        reliability=ReliabilityPolicy.get_from_short_key(profile['reliability']),
        durability=DurabilityPolicy.get_from_short_key(profile['durability']),
        liveliness=LivelinessPolicy.get_from_short_key(profile['liveliness']),
    )


def information(bag: Path) -> dict[str, Any]:
    """rosbag2's record of the bag, the same in metadata.yaml and in the file; checks its types."""
    found: dict[str, Any] = yaml.safe_load((bag / 'metadata.yaml').read_text())[
        'rosbag2_bagfile_information'
    ]
    assert found['version'] == 9
    assert found['storage_identifier'] == 'mcap'
    assert type(found['message_count']) is int
    assert type(found['duration']['nanoseconds']) is int
    assert type(found['starting_time']['nanoseconds_since_epoch']) is int
    for text in ('compression_format', 'compression_mode'):  # chunks are the storage's own matter
        assert found[text] == ''
    for text in (found['custom_data'] or {}).items():
        assert [type(word) for word in text] == [str, str]
    assert isinstance(found['ros_distro'], str)
    assert [bag / path for path in found['relative_file_paths']] == list(bag.glob('*.mcap'))
    assert [file['path'] for file in found['files']] == found['relative_file_paths']
    for topic in found['topics_with_message_count']:
        assert type(topic['message_count']) is int
        assert topic['topic_metadata']['serialization_format'] == 'cdr'
        assert topic['topic_metadata']['type_description_hash'].startswith('RIHS01_')
        offered_qos(topic['topic_metadata']['offered_qos_profiles'])
    with (bag / found['relative_file_paths'][0]).open('rb') as stream:
        (record,) = make_reader(stream).iter_metadata()
    assert record.name == 'rosbag2'
    assert yaml.safe_load(record.metadata['serialized_metadata']) == found
    return found


def decoded(bag: Path) -> dict[str, list[Any]]:
    """All messages of a bag by topic, decoded from the definitions in the file."""
    messages: dict[str, list[Any]] = {}
    with next(bag.glob('*.mcap')).open('rb') as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            messages.setdefault(channel.topic, []).append(message)
    return messages


def message_type(name: str) -> type:
    """The class of a message, from a name such as ``std_msgs/msg/Header``."""
    package, kind, message = name.split('/')
    found: type = getattr(importlib.import_module(f'{package}.{kind}'), message)
    return found


def play(bag: Path, node: Any) -> None:
    """Publish the messages of a bag in the order of the file, once somebody listens to each."""
    with next(bag.glob('*.mcap')).open('rb') as stream:
        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        publishers = {
            channel.topic: node.create_publisher(
                message_type(summary.schemas[channel.schema_id].name),
                channel.topic,
                offered_qos(yaml.safe_load(channel.metadata['offered_qos_profiles'])),
            )
            for channel in summary.channels.values()
        }
        deadline = time.monotonic() + 20.0
        watched = [publishers[topic] for topic in publishers if topic != '/rosout']
        while not all(publisher.get_subscription_count() for publisher in watched):
            assert time.monotonic() < deadline, 'nobody listens'
            time.sleep(0.02)
        for number, (_, channel, message) in enumerate(reader.iter_messages(log_time_order=False)):
            publishers[channel.topic].publish(message.data)
            if number % 25 == 0:
                time.sleep(0.001)
