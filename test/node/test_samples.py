"""Sample topics read and written in place, against ROS's own messages."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message

from maglev_model.contract.wire import TOPIC_TYPES, Incoming, Outgoing
from maglev_msgs.msg import Currents
from maglev_node import samples
from maglev_node.stamp import nanoseconds, set_stamp
from maglev_node.topics import (
    CURRENTS,
    KEYS,
    MEASUREMENT,
    SAMPLE_TOPICS,
    STAGE_PROGRESS,
    sample_qos,
)

STAMP = 1_790_000_000_123_456_789


def sent(topic: str) -> dict[str, Any]:
    """A value of its own for each field, and each element."""
    values: dict[str, Any] = {}
    for number, field in enumerate(TOPIC_TYPES[KEYS[topic]].fields, start=1):
        kind = np.dtype(field.kind)
        elements = (np.arange(field.length) + 10 * number).astype(kind)
        values[field.name] = elements if field.length > 1 else elements[0].item()
    return values


@pytest.mark.parametrize('frame', ['', 'stage', 'a_frame_of_the_stage'])
@pytest.mark.parametrize('topic', SAMPLE_TOPICS)
def test_ros_reads_what_is_written(topic: str, frame: str) -> None:
    message = Outgoing(KEYS[topic], frame)
    message.set_stamp(STAMP)
    for name, value in sent(topic).items():
        message[name] = value
    received: Any = deserialize_message(message.serialized(), SAMPLE_TOPICS[topic])
    assert received.header.frame_id == frame
    assert nanoseconds(received.header.stamp) == STAMP
    for name, value in sent(topic).items():
        np.testing.assert_array_equal(getattr(received, name), value)


@pytest.mark.parametrize('frame', ['', 'stage', 'a_frame_of_the_stage'])
@pytest.mark.parametrize('topic', SAMPLE_TOPICS)
def test_what_ros_writes_is_read(topic: str, frame: str) -> None:
    message: Any = SAMPLE_TOPICS[topic](**sent(topic))
    message.header.frame_id = frame
    set_stamp(message.header.stamp, STAMP)
    received = Incoming(KEYS[topic]).read(serialize_message(message))
    assert received.stamp == STAMP
    for name, value in sent(topic).items():
        np.testing.assert_array_equal(getattr(received, name), value)


class Publishers:
    """A node whose publishers keep what they are given, by topic."""

    def __init__(self) -> None:
        self.sent: dict[str, list[Any]] = {}

    def create_publisher(self, kind: type, topic: str, _qos: object) -> Any:
        sent = self.sent[topic] = []

        class Publisher:
            def publish(self, message: bytes) -> None:
                sent.append(deserialize_message(message, kind))

        return Publisher()


@pytest.mark.parametrize('first', [0, 3, 16, 31])
def test_progress_is_each_sample_until_it_is_steady_then_every_sixteenth(first: int) -> None:
    node: Any = Publishers()
    measured = samples.SampleWriter(node, MEASUREMENT, sample_qos())
    progress = samples.ProgressWriter(node, STAGE_PROGRESS, measured)
    resting, flying = range(first, first + 5), range(first + 5, first + 60)
    landed = range(first + 60, first + 64)
    for sequence in (*resting, *flying, *landed):
        measured['sequence'] = sequence
        measured.publish()
        progress.publish(sequence, steady=sequence in flying)
    assert [message.sequence for message in node.sent[MEASUREMENT]] == list(
        range(first, first + 64)
    )
    due = [sequence for sequence in flying[1:] if sequence in (16, 32, 48, 64, 80)]
    expected = [*resting, flying[0], *due, *landed]
    assert [message.sequence for message in node.sent[STAGE_PROGRESS]] == expected


def test_what_cannot_be_read_is_left_out_and_said() -> None:
    said, came = [], []

    class Node:
        def get_logger(self) -> Any:
            return self

        def error(self, text: str, *, once: bool) -> None:
            assert once
            said.append(text)

        def resolve_topic_name(self, topic: str) -> str:
            return f'/here/{topic}'

        def create_subscription(self, *given: Any, raw: bool) -> Any:
            assert raw
            return given

    node: Any = Node()
    subscription: Any = samples.hear(node, CURRENTS, came.append)
    good = serialize_message(Currents(sequence=5))
    for message in (good[:-3], good):
        subscription[2](message)
    assert [message.sequence for message in came] == [5]
    assert len(said) == 1
    assert said[0].startswith('/here/stage/currents: a maglev_msgs/msg/Currents ')
