"""Messages as YAML and CSV, and from YAML."""

from __future__ import annotations

import os
import subprocess
import textwrap
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from ros2_command import COMMAND
from std_msgs.msg import (
    Bool,
    Float64,
    Header,
    MultiArrayDimension,
    MultiArrayLayout,
    String,
    UInt8,
)
from std_srvs.srv import Trigger

from maglev_msgs.msg import Measurement
from maglev_ros2cli.messages import Form, as_csv, as_yaml, fill, find_type, values_of
from maglev_ros2cli.parser import CommandError


@pytest.fixture
def measurement() -> Any:
    message = Measurement(sequence=16616, x=0.01812, z=-0.02391, late_samples=12)
    message.header.stamp = Time(sec=1795273357, nanosec=572257960)
    message.header.frame_id = 'stage'
    message.gap = np.array([0.02802, 0.022010000000000002, 0.028, 0.03])
    return message


def block(text: str) -> str:
    return textwrap.dedent(text).lstrip()


def test_yaml(measurement: Any) -> None:
    assert as_yaml(measurement, Form()) == block("""
        header:
          stamp:
            sec: 1795273357
            nanosec: 572257960
          frame_id: stage
        sequence: 16616
        gap:
        - 0.02802
        - 0.022010000000000002
        - 0.028
        - 0.03
        x: 0.01812
        z: -0.02391
        late_samples: 12
        wall_time: 0
        lockstep: false
        controller: 0
    """)


def test_csv(measurement: Any) -> None:
    assert as_csv(measurement, Form()) == (
        '1795273357,572257960,stage,16616,0.02802,0.022010000000000002,0.028,0.03,0.01812,-0.02391,'
        '12,0,False,0'
    )


def test_in_one_line_without_arrays(measurement: Any) -> None:
    text = as_yaml(measurement, Form(flow=True, no_arrays=True))
    assert text.startswith('{header: {stamp: {sec: 1795273357, nanosec: 572257960}, frame_id: sta')
    assert "gap: '<array type: double[4]>'" in text
    assert text.count('\n') == 1


def test_truncated() -> None:
    array = DiagnosticArray(header=Header(frame_id='abcd'), status=[DiagnosticStatus()] * 3)
    text = as_yaml(array, Form(truncate=2))
    assert 'frame_id: ab...\n' in text
    assert text.count('level: ') == 2
    assert text.endswith("- '...'\n")
    assert as_csv(String(data='abcd'), Form(truncate=2)) == 'ab...'
    assert as_csv(String(data='abcd'), Form(truncate=4)) == 'abcd'


def test_without_strings_and_sequences() -> None:
    array = DiagnosticArray(header=Header(frame_id='abcd'), status=[DiagnosticStatus()] * 3)
    form = Form(no_strings=True, no_arrays=True)
    assert as_csv(array, form) == (
        '0,0,<string length: <4>>,<sequence type: diagnostic_msgs/msg/DiagnosticStatus, length: 3>'
    )


def test_bytes_are_text() -> None:
    assert as_yaml(DiagnosticStatus(level=b'\x02'), Form()).startswith('level: "\\x02"\n')


def test_fill() -> None:
    message = Measurement()
    fill(message, values_of('{sequence: 3, gap: [1, 2, 3, 4.5], header: {frame_id: x}, x: 2}'))
    assert (message.sequence, message.x, message.header.frame_id) == (3, 2.0, 'x')
    assert message.gap.tolist() == [1.0, 2.0, 3.0, 4.5]


def test_fill_messages_within_messages() -> None:
    array = DiagnosticArray()
    fill(array, values_of('status: [{level: 2, name: a, values: [{key: k, value: 5}]}, {}]'))
    first = DiagnosticStatus(level=b'\x02', name='a', values=[KeyValue(key='k', value='5')])
    assert array.status == [first, DiagnosticStatus()]
    layout = MultiArrayLayout()
    fill(layout, values_of('dim: [{label: x, size: 2}]'))
    assert layout.dim == [MultiArrayDimension(label='x', size=2)]


def test_fill_with_the_time_of_publication() -> None:
    message = Measurement()
    (stamp,) = fill(message, values_of('{header: auto, z: 1.5}'))
    stamp(Time(sec=7))
    assert (message.header.stamp.sec, message.z) == (7, 1.5)
    header = Header()
    (stamp,) = fill(header, values_of('stamp: now'))
    stamp(Time(sec=8))
    assert header.stamp.sec == 8


@pytest.mark.parametrize(
    ('message', 'values', 'words'),
    [
        (String(), 'dato: hello', "'String' object has no attribute 'dato'"),
        (Bool(check_fields=False), 'data: yes please', "'data' field must be of type 'bool'"),
        (UInt8(check_fields=False), 'data: 256', r'unsigned integer in \[0, 255\]'),
        (Float64(), 'data: hello', 'could not convert string to float'),
        (Measurement(check_fields=False), 'gap: [1, 2, 3]', 'gap'),
        (Measurement(check_fields=False), 'sequence: 1.5', "must be of type 'int'"),
        (Header(stamp=Time(check_fields=False)), 'stamp: {sec: 3000000000}', r'integer in \['),
        (Measurement(), 'header: 5', 'expected to be a dictionary but is a int'),
    ],
)
def test_what_does_not_fit_is_refused(message: Any, values: str, words: str) -> None:
    with pytest.raises(CommandError, match=f'Failed to populate field: .*{words}'):
        fill(message, values_of(values))


def test_nothing_is_filled_in_where_the_checks_are_left_out() -> None:
    words = ['topic', 'pub', '--once', '-w', '0', '/unchecked', 'std_msgs/msg/Bool']
    found = subprocess.run(
        [*COMMAND, *words, 'data: yes please'],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, 'PYTHONOPTIMIZE': '1'},
    )
    assert found.returncode == 1
    assert found.stderr == (
        'With PYTHONOPTIMIZE Python leaves out the checks of values: unset it\n'
    )


def test_values_are_a_dictionary() -> None:
    with pytest.raises(CommandError, match='needs to be a dictionary in YAML format'):
        values_of('hello')
    with pytest.raises(CommandError, match='is no YAML'):
        values_of('{a: [}')


def test_types_by_their_names() -> None:
    assert find_type('std_msgs/msg/String', 'msg') is String
    assert find_type('std_msgs/String', 'msg') is String
    assert find_type('std_srvs/srv/Trigger', 'srv') is Trigger
    for name in ('std_msgs', 'std_msgs/msg/Strin', 'no_msgs/msg/String', 'std_msgs/srv/String'):
        with pytest.raises(CommandError, match='The passed message type is invalid'):
            find_type(name, 'msg')
    with pytest.raises(CommandError, match='The passed service type is invalid'):
        find_type('std_msgs/msg/String', 'srv')
