"""Bags: recorded from a real node, told of, played to it."""

from __future__ import annotations

import errno
import os
import re
import signal
import time
from pathlib import Path

import pytest
from graph import Process
from rclpy.serialization import serialize_message
from ros2_command import COMMAND, Ros2
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from std_msgs.msg import String

from maglev_monitor.bag.reader import Bag
from maglev_monitor.bag.recorder import message_folder
from maglev_monitor.bag.writer import BagWriter, ChunkFile
from maglev_ros2cli.commands.bag_info import moment, size

START = 1_795_270_476_273_521_421
SECOND = 1_000_000_000


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    """Three strings within 0.2 s, for ``/heard``."""
    path = tmp_path / 'bag'
    writer = BagWriter(path, message_folder)
    writer.open()
    writer.add_topic('/heard', 'std_msgs/msg/String')
    texts = ('first of bag', 'second of bag', 'third of bag')
    writer.write(
        '/heard',
        [
            (serialize_message(String(data=text)), START + n * SECOND // 10)
            for n, text in enumerate(texts)
        ],
    )
    writer.close()
    return path


def test_info(ros2: Ros2, bag: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('TZ', 'UTC')
    time.tzset()
    size_told = size((bag / 'bag_0.mcap').stat().st_size)
    assert ros2('bag', 'info', str(bag)).out == (
        '\n'
        'Files:             bag_0.mcap\n'
        f'Bag size:          {size_told}\n'
        'Storage id:        mcap\n'
        'ROS Distro:        jazzy\n'
        'Duration:          0.200000000s\n'
        'Start:             Nov 21 2026 14:14:36.273521421 (1795270476.273521421)\n'
        'End:               Nov 21 2026 14:14:36.473521421 (1795270476.473521421)\n'
        'Messages:          3\n'
        'Topic information: Topic: /heard | Type: std_msgs/msg/String | Count: 3'
        ' | Serialization Format: cdr\n'
        'Service:           0\n'
        'Service information: \n'
    )
    assert ros2('bag', 'info', '-t', str(bag)).out == '/heard\n'
    file = str(bag / 'bag_0.mcap')
    assert 'Messages:          3\n' in ros2('bag', 'info', file).out


def test_sizes_and_moments(monkeypatch: pytest.MonkeyPatch) -> None:
    assert size(1023) == '1023 B'
    assert size(1024) == '1.0 KiB'
    assert size(8.4 * 1024**2) == '8.4 MiB'
    monkeypatch.setenv('TZ', 'UTC')
    time.tzset()
    assert moment(5) == 'Jan  1 1970 00:00:00.000000005 (0.000000005)'


def test_what_is_no_bag(ros2: Ros2, tmp_path: Path) -> None:
    code, out, err = ros2('bag', 'info', str(tmp_path))
    assert (code, out) == (1, '')
    assert f"cannot read the bag '{tmp_path}'" in err
    (tmp_path / 'half.mcap').write_bytes(b'\x89MCAP0\r\n half')
    assert ros2('bag', 'play', str(tmp_path / 'half.mcap')).code == 1


def test_play(ros2: Ros2, small: Process, bag: Path) -> None:
    start = time.monotonic()
    code, _, err = ros2('bag', 'play', str(bag), '-r', '0.5', '--clock')
    assert code == 0
    assert time.monotonic() - start >= 0.4
    assert '[rosbag2_player]: Set rate to 0.5' in err
    small.wait_for('heard: third of bag')
    assert re.findall('heard: (.*) of bag', small.output) == ['first', 'second', 'third']


def test_play_some_of_it(ros2: Ros2, small: Process, bag: Path) -> None:
    before = small.output.count('heard: ')
    ros2('bag', 'play', str(bag), '--remap', '/heard:=/unheard')
    ros2('bag', 'play', str(bag), '--topics', '/other')
    ros2('bag', 'play', str(bag), '--start-offset', '0.15')
    deadline = time.monotonic() + 10.0
    while small.output.count('heard: ') == before and time.monotonic() < deadline:
        time.sleep(0.02)
    assert small.output.splitlines()[-1].endswith('heard: third of bag')
    assert small.output.count('heard: ') == before + 1
    assert ros2('bag', 'play', str(bag), '--remap', 'nonsense').code == 1


def test_record(small: Process, ros2: Ros2, tmp_path: Path) -> None:
    path = tmp_path / 'recorded'
    words = [
        'bag',
        'record',
        '-o',
        str(path),
        '-s',
        'mcap',
        '/kept',
        '--topics',
        '/stage/measurement',
    ]
    process = Process([*COMMAND, *words], tmp_path / 'log')
    process.wait_for("Subscribed to topic '/stage/measurement'")
    time.sleep(0.5)
    process.signal(signal.SIGINT)
    assert process.wait() == 0
    assert '[rosbag2_recorder]: Recording stopped' in process.output
    recorded = Bag(path)
    batches = list(recorded.batches())
    assert recorded.notes == []
    assert recorded.counts['/kept'] == 1
    numbers = [n for batch in batches for n in batch.samples['measurement']['sequence'].tolist()]
    assert len(numbers) >= 20
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    assert set(ros2('bag', 'info', '-t', str(path)).out.split()) == {'/kept', '/stage/measurement'}
    again = ros2('bag', 'record', '-a', '-o', str(path))
    assert again.err == f"[ERROR] [ros2bag]: Output folder '{path}' already exists.\n"


def test_record_wants_topics(ros2: Ros2, tmp_path: Path) -> None:
    code, _, err = ros2('bag', 'record', '-o', str(tmp_path / 'bag'))
    assert code == 1
    assert err.startswith('[ERROR] [ros2bag]: Need to specify at least one option out of')
    assert ros2('bag', 'record', '-a', '-s', 'sqlite3').code == 2
    file = tmp_path / 'qos.yaml'
    file.write_text('/a: {reliability: nonsense}')
    code, _, err = ros2(
        *('bag', 'record', '-a', '-o', str(tmp_path / 'bag')),
        *('--qos-profile-overrides-path', str(file)),
    )
    assert code == 1
    assert f"QoS profiles in '{file}'" in err


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (['record', '--regex', '['], "'[' is no expression: unterminated character set"),
        (['play', '.', '--delay', '-1'], "'-1' is no finite number of at least 0"),
        (['play', '.', '--start-offset', 'inf'], "'inf' is no finite number of at least 0"),
        (['play', '.', '-r', '0'], "'0' is no finite number above 0"),
    ],
)
def test_what_cannot_be_meant_is_refused_in_a_line(ros2: Ros2, words: list[str], said: str) -> None:
    code, _, err = ros2('bag', *words)
    assert code == 2
    assert said in err.splitlines()[-1]


def test_info_of_a_compressed_bag(ros2: Ros2, tmp_path: Path) -> None:
    writer = Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        typestore = get_typestore(Stores.ROS2_JAZZY)
        heard = writer.add_connection('/heard', 'std_msgs/msg/String', typestore=typestore)
        writer.write(heard, START, serialize_message(String(data='first of bag')))
    out = ros2('bag', 'info', str(tmp_path / 'bag')).out
    assert 'Files:             bag.mcap.zstd\n' in out
    assert 'Storage id:        mcap\n' in out


def test_a_disk_that_is_full_ends_a_recording_in_a_line(
    ros2: Ros2, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: ChunkFile, data: bytes) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(ChunkFile, 'write', full)
    code, _, err = ros2('bag', 'record', '-a', '-o', str(tmp_path / 'bag'))
    assert code == 1
    assert 'no space left on device' in err.splitlines()[-1]
    assert err.splitlines()[-1].startswith('[ERROR] [ros2bag]: cannot ')
