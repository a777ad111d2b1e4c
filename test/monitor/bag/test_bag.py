"""Bags: what rosbags reads of ours, and what we read of whole, cut-off and foreign ones."""

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
import numpy as np
import pytest
from made_up_run import MESSAGES, TOPICS, open_bag, write_samples
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import Reader, StoragePlugin, Writer

from maglev_model.progress import Progress
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.chunk_file import ChunkFile
from maglev_monitor.bag.columns import table
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.mcap_file import McapFile
from maglev_monitor.bag.reader import Bag
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


def read(path: Path) -> tuple[dict[str, int], list[str]]:
    """Samples by topic key, and notes."""
    bag = Bag(path)
    counts: dict[str, int] = {}
    for batch in bag.batches():
        for key, records in batch.samples.items():
            counts[key] = counts.get(key, 0) + len(records)
    return counts, bag.notes


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


@pytest.mark.parametrize('share', [0.2, 0.5, 0.9, 0.999])
def test_a_file_cut_anywhere_gives_its_front(
    share: float, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_samples(writer, run, messages)
    writer.close()
    whole = (tmp_path / 'bag' / 'bag_0.mcap').read_bytes()
    cut = tmp_path / 'cut.mcap'
    cut.write_bytes(whole[: int(share * len(whole))])
    counts, notes = read(cut)
    recovered = sum(counts.values()) / (5 * len(run))
    assert recovered > share - 0.02
    assert any('recovered' in note for note in notes)
    found = np.concatenate(
        [
            batch.samples['currents']['sequence']
            for batch in Bag(cut).batches()
            if 'currents' in batch.samples
        ]
    )
    np.testing.assert_array_equal(found, np.arange(len(found)))


def test_a_damaged_chunk_ends_the_reading(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag', compress=True)
    write_samples(writer, run, messages)
    writer.flush()
    file = tmp_path / 'bag' / 'bag_0.mcap'
    size = file.stat().st_size
    write_samples(writer, run, messages)
    writer.close()
    content = bytearray(file.read_bytes())
    content[size + 53 : size + 60] = bytes(7)  # the compressed data's own head
    file.write_bytes(content)
    counts, notes = read(tmp_path / 'bag')
    assert counts['plant'] >= len(run)
    assert 'a chunk is damaged' in notes[0]


def test_runs_one_after_the_other_are_not_taken_for_one(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'twice')
    write_samples(writer, run, messages)
    write_samples(writer, run, messages)
    writer.close()
    for reads in (analyse, table):
        with pytest.raises(BagError, match="twice' holds several runs"):
            reads(tmp_path / 'twice')


def test_a_bag_without_metadata_is_read(bag: Path, tmp_path: Path, run: Any) -> None:
    copy = tmp_path / 'copy'
    shutil.copytree(bag, copy)
    (copy / 'metadata.yaml').unlink()
    counts, notes = read(copy)
    assert counts['plant'] == len(run)
    assert 'no metadata.yaml' in notes[0]


@pytest.mark.parametrize('place', ['bag', 'bag/bag_0.mcap', 'bag/metadata.yaml', '.'])
def test_a_bag_is_found_by_any_of_its_names(place: str, bag: Path, run: Any) -> None:
    counts, notes = read(bag.parent / place)
    assert counts['currents'] == len(run)
    assert notes == []


def write_sqlite(
    path: Path, samples: range, run: Any, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        for key, (topic, message_type) in TOPICS.items():
            connection = writer.add_connection(topic, message_type, typestore=encoder.store)
            for n in samples:
                writer.write(connection, int(run.stamp[n]), messages[key][n])


def test_sqlite_bags_are_read(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    write_sqlite(tmp_path / 'bag', range(len(run)), run, messages, encoder)
    assert read(tmp_path / 'bag')[0] == {key: len(run) for key in TOPICS}


def test_a_sqlite_bag_without_metadata_is_read_file_by_file(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    killed = tmp_path / 'killed'
    killed.mkdir()
    for number, samples in enumerate((range(700), range(700, len(run)))):
        write_sqlite(tmp_path / 'bag', samples, run, messages, encoder)
        (tmp_path / 'bag' / 'bag.db3').rename(killed / f'killed_{number}.db3')
        shutil.rmtree(tmp_path / 'bag')
    counts, notes = read(killed)
    assert counts == {key: len(run) for key in TOPICS}
    assert notes == [f"'{killed}' has no metadata.yaml: read without it"]


@pytest.mark.parametrize(
    ('name', 'content', 'message'),
    [
        ('nothing.mcap', None, 'there is no bag'),
        ('empty.mcap', b'', 'is no mcap file'),
        ('text.mcap', b'not a bag at all', 'is no mcap file'),
        ('text.txt', b'not a bag at all', 'is no bag'),
        ('head.mcap', MCAP0_MAGIC, 'holds no message'),
    ],
)
def test_what_is_no_bag_is_refused(
    name: str, content: bytes | None, message: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BagError, match=message):
        read(path)


def test_an_empty_folder_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(BagError, match=r'no \.mcap and no \.db3'):
        Bag(tmp_path)


def test_a_bag_without_a_run_is_refused(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    writer.write('/stage/measurement', [(messages['measurement'][0], 1)])
    writer.close()
    with pytest.raises(BagError, match='the reference never left REST'):
        analyse(tmp_path / 'bag')


def test_a_bag_with_the_runs_of_two_stages_is_refused(
    tmp_path: Path, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    for topic in ('/stage/currents', '/stage2/stage/currents'):
        if topic not in writer.counts:
            writer.add_topic(topic, 'maglev_msgs/msg/Currents')
        writer.write(topic, [(messages['currents'][0], 1)])
    writer.close()
    with pytest.raises(BagError, match=r'holds more than one run.*/stage2/stage/currents'):
        read(tmp_path / 'bag')


def test_what_repeats_a_part_of_the_samples_counts_for_nothing(
    tmp_path: Path, messages: dict[str, list[bytes]]
) -> None:
    """As in a bag of all topics, by somebody else's recorder."""
    writer = open_bag(tmp_path / 'bag')
    writer.add_topic('/stage/progress', 'maglev_msgs/msg/Measurement')
    writer.write('/stage/progress', [(messages['measurement'][0], 1)])
    writer.write('/stage/measurement', [(each, 1) for each in messages['measurement'][:5]])
    writer.write('/stage/progress', [(messages['measurement'][4], 1)])
    writer.close()
    assert read(tmp_path / 'bag') == ({'measurement': 5}, [])


def test_other_messages_of_the_same_name_are_refused(tmp_path: Path) -> None:
    writer = open_bag(tmp_path / 'bag')
    writer.write('/reference', [(b'\x00\x01\x00\x00' + bytes(60), 1)])
    writer.close()
    with pytest.raises(BagError, match='another version of maglev_msgs'):
        read(tmp_path / 'bag')


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


def test_files_of_a_bag_are_read_in_the_order_of_their_numbers(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    (tmp_path / 'bag').mkdir()
    for number in range(12):
        writer = open_bag(tmp_path / f'part{number}')
        part = slice(100 * number, 100 * (number + 1))
        stamps = run.stamp[part].tolist()
        writer.write('/stage/currents', zip(messages['currents'][part], stamps, strict=True))
        writer.close()
        file = tmp_path / f'part{number}' / f'part{number}_0.mcap'
        file.rename(tmp_path / 'bag' / f'bag_{number}.mcap')
    sequence = [batch.samples['currents']['sequence'] for batch in Bag(tmp_path / 'bag').batches()]
    np.testing.assert_array_equal(np.concatenate(sequence), np.arange(len(run)))


@pytest.mark.parametrize('length', [2**31, 2**45, 2**63, 2**64 - 1])
def test_a_length_that_cannot_be_ends_the_reading(
    length: int, bag: Path, tmp_path: Path, run: Any
) -> None:
    content = bytearray((bag / 'bag_0.mcap').read_bytes())
    with (bag / 'bag_0.mcap').open('rb') as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    start = summary.chunk_indexes[1].chunk_start_offset
    for name, place in (('record', start + 1), ('data', start + 9 + 28 + 4)):
        damaged = content.copy()
        damaged[place : place + 8] = length.to_bytes(8, 'little')
        (tmp_path / f'{name}.mcap').write_bytes(damaged)
        counts, notes = read(tmp_path / f'{name}.mcap')
        assert 0 < counts['plant'] < len(run)
        assert 'recovered' in notes[0]


def test_reading_knows_a_whole_file(bag: Path) -> None:
    file = McapFile(bag / 'bag_0.mcap')
    assert sum(len(topic.data) for chunk in file.chunks() for topic in chunk) == 6001
    assert file.complete
    assert file.damage == ''


def test_python_ignores_the_file_size_signal() -> None:
    assert signal.getsignal(signal.SIGXFSZ) == signal.SIG_IGN


def test_the_bar_of_what_is_read_ends(
    bag: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True)
    monkeypatch.setattr('maglev_model.progress._AFTER', 0.0)
    monkeypatch.setattr('maglev_model.progress._REDRAWN', 0.0)
    for _ in Bag(bag, Progress('read', '%', lines=False)).batches():
        pass
    bars = capsys.readouterr().out.split('\r\033[K')
    assert len(bars) > 2
    assert bars[-1].startswith('read [########################] 100 %')
    assert bars[-1].endswith('\n')
    next(Bag(bag, Progress('read', '%', lines=False)).batches())
    left_early = capsys.readouterr().out
    assert '100 %' not in left_early
    assert left_early.endswith('\n')
