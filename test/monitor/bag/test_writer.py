"""Bags: what rosbags reads of ours, and what is left of one that cannot be written."""

from __future__ import annotations

import errno
import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import made_up_run
import pytest
from made_up_run import MESSAGES, TOPICS, open_bag, read, write_samples
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Reader

from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.chunk_file import ChunkFile
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.writer import BagWriter

QOS = Qos(
    QosHistory.KEEP_LAST,
    256,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    QosTime(9223372036, 854775807),
    QosTime(9223372036, 854775807),
    QosLiveliness.AUTOMATIC,
    QosTime(9223372036, 854775807),
    False,
)


@pytest.mark.parametrize('compress', [False, True])
def test_rosbags_reads_what_we_write(
    compress: bool, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = BagWriter(tmp_path / 'bag', lambda _: MESSAGES, compress=compress)
    writer.open()
    for topic, message_type in TOPICS.values():
        writer.add_topic(topic, message_type, [QOS])
    write_samples(writer, run, messages)
    writer.close()
    writer.close()
    with Reader(tmp_path / 'bag') as reader:
        assert {c.topic: c.msgcount for c in reader.connections} == {
            topic: len(run) for topic, _ in TOPICS.values()
        }
        extensions: list[Any] = [connection.ext for connection in reader.connections]
        assert all(extension.offered_qos_profiles == [QOS] for extension in extensions)
        assert all('std_msgs/Header header' in c.msgdef.data for c in reader.connections)
        found: dict[str, list[bytes]] = {topic: [] for topic, _ in TOPICS.values()}
        for connection, _, data in reader.messages():
            found[connection.topic].append(bytes(data))
    for key, (topic, _) in TOPICS.items():
        assert found[topic] == messages[key]
    assert read(tmp_path / 'bag') == ({key: len(run) for key in TOPICS}, [])


def test_type_hashes_are_those_of_ros(bag: Path) -> None:
    installed = os.environ.get('AMENT_PREFIX_PATH', '').split(':')
    files = [
        file for prefix in installed for file in Path(prefix).glob('share/maglev_msgs/msg/*.json')
    ]
    if not files:
        pytest.skip('maglev_msgs is not built')
    text = (bag / 'metadata.yaml').read_text()
    for file in files:
        digest = file.read_text().split('"hash_string": "')[1].split('"')[0]
        assert digest in text


@pytest.mark.parametrize('compress', [False, True])
def test_a_killed_recorder_leaves_what_was_flushed(
    compress: bool, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag', compress=compress)
    write_samples(writer, run, messages)
    writer.flush()
    writer.write('/reference', [(messages['reference'][0], 1)])  # lost with the process
    counts, notes = read(tmp_path / 'bag')
    verdict = analyse(tmp_path / 'bag').result['verdict']
    writer.close()
    assert counts == {key: len(run) for key in TOPICS}
    assert len(notes) == 1
    assert f'was cut off: {5 * len(run)} messages recovered' in notes[0]
    assert verdict == 'pass'


@pytest.mark.parametrize('killed', [True, False])
def test_what_a_killed_recorder_had_not_written_yet_is_not_missing(
    killed: bool, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    for key, (topic, _) in TOPICS.items():
        count = 600 if key in ('currents', 'plant') else 800
        writer.write(topic, zip(messages[key][:count], run.stamp[:count].tolist(), strict=True))
    writer.flush() if killed else writer.close()
    result = analyse(tmp_path / 'bag').result
    writer.close()
    assert result['verdict'] == 'incomplete'
    assert result['missing_samples'] == (0 if killed else 400)


def test_an_existing_bag_is_not_touched(bag: Path) -> None:
    before = (bag / 'bag_0.mcap').stat()
    with pytest.raises(BagError, match='exists already'):
        open_bag(bag)
    assert (bag / 'bag_0.mcap').stat().st_mtime_ns == before.st_mtime_ns


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / 'file').write_text('')
    with pytest.raises(BagError, match=r'cannot write the bag .*: not a directory'):
        open_bag(tmp_path / 'file' / 'bag')


def test_unknown_message_types_are_refused(tmp_path: Path) -> None:
    writer = open_bag(tmp_path / 'bag')
    with pytest.raises(BagError, match='no definition of'):
        writer.add_topic('/other', 'maglev_msgs/msg/Nothing')
    writer.close()


def test_a_nearly_full_disk_ends_the_recording_in_order(
    tmp_path: Path,
    run: Any,
    messages: dict[str, list[bytes]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, run, messages)
    usage = type('Usage', (), {'free': 1000})
    monkeypatch.setattr(shutil, 'disk_usage', lambda _: usage)
    with pytest.raises(BagError, match='the disk is full'):
        writer.flush()
    writer.close()
    assert read(tmp_path / 'bag') == ({key: len(run) for key in TOPICS}, [])


_LIMITED = """
import resource, sys
sys.path.insert(0, sys.argv[1].rpartition('/')[0])
import made_up_run
from pathlib import Path
from maglev_monitor.bag.columns import table
from maglev_monitor.bag.errors import BagError
run = made_up_run.make_run(1200)
encoder = made_up_run.Encoder()
messages = {key: [encoder.message(run, key, n) for n in range(1200)] for key in made_up_run.TOPICS}
writer = made_up_run.open_bag(Path(sys.argv[2]))
resource.setrlimit(resource.RLIMIT_FSIZE, (900_000, 900_000))
try:
    for _ in range(10):
        made_up_run.write_samples(writer, run, messages)
except BagError as error:
    print(error)
    writer.close()
"""


def test_a_file_that_may_not_grow_is_finished_as_it_was(tmp_path: Path) -> None:
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[1] == resource.RLIM_INFINITY
    path = tmp_path / 'bag'
    command = [sys.executable, '-c', _LIMITED, made_up_run.__file__, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert 'cannot write the bag' in done.stdout
    assert 'file too large' in done.stdout
    counts, notes = read(path)
    assert notes == []
    with Reader(path) as reader:
        assert reader.message_count == sum(counts.values()) > 2000
        assert sum(1 for _ in reader.messages()) == reader.message_count


def test_a_chunk_that_cannot_be_written_is_lost_alone(
    tmp_path: Path,
    run: Any,
    messages: dict[str, list[bytes]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, run, messages)
    writer.flush()
    disk_full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    write = ChunkFile.write

    def half(file: ChunkFile, data: bytes) -> int:
        write(file, data[: len(data) // 2])
        raise disk_full

    monkeypatch.setattr(ChunkFile, 'write', half)
    writer.write('/reference', [(messages['reference'][0], 1)])
    with pytest.raises(BagError, match=r'cannot write the bag .*: no space left on device'):
        writer.flush()
    with pytest.raises(BagError, match='analyze can recover it'):
        writer.close()
    writer.close()
    counts, notes = read(tmp_path / 'bag')
    assert counts == {key: len(run) for key in TOPICS}
    assert len(notes) == 1
    assert analyse(tmp_path / 'bag').result['verdict'] == 'pass'


def test_python_ignores_the_file_size_signal() -> None:
    assert signal.getsignal(signal.SIGXFSZ) == signal.SIG_IGN
