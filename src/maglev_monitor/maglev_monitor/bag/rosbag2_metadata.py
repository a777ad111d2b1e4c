"""What rosbag2 wants to know of a bag: its record of the bag, version 9, and QoS. No ROS here."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import yaml
from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import dump_qos_v9

_VERSION = 9
_DISTRIBUTION = 'jazzy'


@dataclasses.dataclass
class Topic:
    """A topic of a bag."""

    name: str
    message_type: str
    type_hash: str
    qos: Sequence[Qos]
    channel: int
    count: int = 0


@dataclasses.dataclass
class Span:
    """Messages of a bag or of one of its files: their number, least and greatest time [ns]."""

    count: int = 0
    first: int = 1 << 63
    last: int = 0

    def described(self) -> dict[str, Any]:
        """As rosbag2 has it."""
        first = self.first if self.count else 0
        return {
            'starting_time': {'nanoseconds_since_epoch': first},
            'duration': {'nanoseconds': self.last - first},
            'message_count': self.count,
        }


def bag_information(
    files: Mapping[str, Span], topics: Sequence[Topic], custom: Mapping[str, str]
) -> dict[str, Any]:
    """``rosbag2_bagfile_information`` of a bag with these mcap files.

    ``custom`` is what ``ros2 bag record --custom-data`` would be given.
    """
    whole = Span(
        sum(span.count for span in files.values()),
        min(span.first for span in files.values()),
        max(span.last for span in files.values()),
    )
    return {
        'version': _VERSION,
        'storage_identifier': 'mcap',
        'relative_file_paths': list(files),
        **whole.described(),
        'topics_with_message_count': [
            {
                'topic_metadata': {
                    'name': topic.name,
                    'type': topic.message_type,
                    'serialization_format': 'cdr',
                    'offered_qos_profiles': dump_qos_v9(list(topic.qos)),
                    'type_description_hash': topic.type_hash,
                },
                'message_count': topic.count,
            }
            for topic in topics
        ],
        'compression_format': '',  # chunks are the file's own matter
        'compression_mode': '',
        'files': [{'path': name, **span.described()} for name, span in files.items()],
        'custom_data': dict(custom) or None,
        'ros_distro': _DISTRIBUTION,
    }


def offered_qos(profiles: Sequence[Qos]) -> str:
    """QoS profiles as YAML, for a channel of the file."""
    return as_yaml(dump_qos_v9(list(profiles)))


def as_yaml(content: Mapping[str, Any] | Sequence[Any]) -> str:
    """YAML with nothing folded and no aliases."""
    return yaml.dump(content, Dumper=_Dumper, default_flow_style=False, width=1 << 16).strip()


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True
