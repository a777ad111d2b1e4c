"""Bags: what is read of whole, cut-off and foreign ones."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from made_up_run import TOPICS, open_bag, read, write_samples
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from maglev_model.programs.progress import Progress
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.columns import table
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.mcap_file import McapFile
from maglev_monitor.bag.reader import Bag


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


@pytest.mark.parametrize('compress', [False, True])
def test_a_byte_that_is_another_one_is_not_taken_for_a_measurement(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]], compress: bool
) -> None:
    writer = open_bag(tmp_path / 'bag', compress=compress)
    write_samples(writer, run, messages)
    writer.close()
    file = tmp_path / 'bag' / 'bag_0.mcap'
    with file.open('rb') as opened:
        summary = make_reader(opened).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[-1]
    content = bytearray(file.read_bytes())
    content[chunk.chunk_start_offset + chunk.chunk_length - chunk.compressed_size // 2] ^= 1
    file.write_bytes(content)
    assert 'a chunk is damaged' in read(tmp_path / 'bag')[1][0]


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


@pytest.mark.parametrize(
    'text', [b'', b'rosbag2_bagfile_information:\n  ver', b'a: [', b'at: 2026-99-99', b'\xff\x00']
)
def test_a_bag_whose_metadata_cannot_be_read_says_so(
    text: bytes, bag: Path, tmp_path: Path, run: Any
) -> None:
    copy = tmp_path / 'copy'
    shutil.copytree(bag, copy)
    (copy / 'metadata.yaml').write_bytes(text)
    counts, notes = read(copy)
    assert counts['plant'] == len(run)
    assert notes == [f"'{copy}' has a metadata.yaml that cannot be read: read without it"]
    assert Bag(copy).custom() == {}


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


@pytest.mark.parametrize('damage', ['cut off', 'empty', 'bytes that are others'])
@pytest.mark.parametrize('storage', [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_damaged_compressed_file_is_told_as_such(
    storage: StoragePlugin,
    damage: str,
    tmp_path: Path,
    messages: dict[str, list[bytes]],
    encoder: Any,
) -> None:
    writer = Writer(tmp_path / 'bag', version=9, storage_plugin=storage)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        reference = writer.add_connection(*TOPICS['reference'], typestore=encoder.store)
        writer.write(reference, 1, messages['reference'][0])
    (file,) = (tmp_path / 'bag').glob('*.zstd')
    whole = file.read_bytes()
    half = len(whole) // 2
    damaged = {'cut off': whole[:half], 'empty': b'', 'bytes that are others': whole[:half] * 2}
    file.write_bytes(damaged[damage])
    with pytest.raises(BagError, match=r'cannot read the bag|holds no message'):
        read(tmp_path / 'bag')


@pytest.mark.parametrize('mode', [CompressionMode.FILE, CompressionMode.MESSAGE])
def test_a_compressed_bag_needs_no_metadata_and_is_read_as_far_as_it_goes(
    mode: CompressionMode, tmp_path: Path, messages: dict[str, list[bytes]], encoder: Any
) -> None:
    writer = Writer(tmp_path / 'bag', version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        for key, topic in TOPICS.items():
            connection = writer.add_connection(*topic, typestore=encoder.store)
            for data in messages[key]:
                writer.write(connection, 1, data)
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    (file,) = (tmp_path / 'bag').iterdir()
    whole = {key: len(messages[key]) for key in TOPICS}
    assert read(file) == (whole, [])
    assert read(file.parent)[0] == whole
    with file.open('r+b') as opened:
        opened.truncate(file.stat().st_size // 2)
    counts, notes = read(file.parent)
    assert 0 < sum(counts.values()) < sum(whole.values())
    assert 'it was cut off' in notes[0]


def test_a_file_that_lies_decompressed_beside_itself_counts_once(
    bag: Path, tmp_path: Path, run: Any
) -> None:
    """As rosbag2 leaves it where it has played one."""
    copy = tmp_path / 'copy'
    shutil.copytree(bag, copy)
    content = (copy / 'bag_0.mcap').read_bytes()
    (copy / 'bag_0.mcap.zstd').write_bytes(zstandard.compress(content))
    assert read(copy)[0]['currents'] == len(run)


def test_diagnostics_that_are_none_are_told_as_such(tmp_path: Path) -> None:
    writer = open_bag(tmp_path / 'bag')
    writer.write('/diagnostics', [(b'compressed one by one', 1)])
    writer.close()
    with pytest.raises(BagError, match='cannot read the bag'):
        read(tmp_path / 'bag')


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


@pytest.mark.parametrize('name', ['bag', 'of.2026.11'])
def test_files_of_a_bag_are_read_in_the_order_of_their_numbers(
    name: str, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    (tmp_path / name).mkdir()
    for number in range(12):
        writer = open_bag(tmp_path / f'part{number}')
        part = slice(100 * number, 100 * (number + 1))
        stamps = run.stamp[part].tolist()
        writer.write('/stage/currents', zip(messages['currents'][part], stamps, strict=True))
        writer.close()
        file = tmp_path / f'part{number}' / f'part{number}_0.mcap'
        file.rename(tmp_path / name / f'{name}_{number}.mcap')
    sequence = [batch.samples['currents']['sequence'] for batch in Bag(tmp_path / name).batches()]
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


def test_the_bar_of_what_is_read_ends(
    bag: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stdout, 'isatty', lambda: True)
    monkeypatch.setattr('maglev_model.programs.progress._AFTER', 0.0)
    monkeypatch.setattr('maglev_model.programs.progress._REDRAWN', 0.0)
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
