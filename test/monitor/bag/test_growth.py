"""What a bag costs does not grow as it gets longer; one that is long has several files."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from long_run import write_long_run
from made_up_run import TOPICS, open_bag, write_samples
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from maglev_monitor.bag import writer as bag_writer
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.chunk_file import ChunkFile
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.reader import Bag
from maglev_monitor.bag.writer import BagWriter


def memory(work: Callable[[], object]) -> tuple[int, int]:
    """What is held after some work and the most that was held meanwhile [bytes]."""
    tracemalloc.start()
    try:
        kept = work()
        found = tracemalloc.get_traced_memory()
        del kept
        return found
    finally:
        tracemalloc.stop()


def test_an_analysis_holds_nothing_for_each_sample(tmp_path: Path) -> None:
    short, long = tmp_path / 'short', tmp_path / 'long'
    for path, samples in ((short, 6_000), (long, 18_000)):
        assert list(write_long_run(path, samples))[-1] == samples
    assert analyse(short).result['verdict'] == 'pass'  # what is made once is there
    before, after = (memory(lambda path=path: analyse(path)) for path in (short, long))
    for fewer, more in zip(before, after, strict=True):
        assert more - fewer < 4 * 12_000  # less than a reference to something for each sample


@pytest.fixture
def short_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_writer, '_CHUNKS_IN_FILE', 20)


def write_flushed(writer: BagWriter, message: bytes, times: int) -> None:
    for time in range(times):
        writer.write('/reference', [(message, 1 + time)])
        writer.flush()


@pytest.mark.usefixtures('short_files')
def test_a_writer_holds_nothing_for_each_chunk(
    tmp_path: Path, messages: dict[str, list[bytes]]
) -> None:
    writer, message = open_bag(tmp_path / 'bag'), messages['reference'][0]
    write_flushed(writer, message, 50)
    few, many = (
        memory(lambda times=times: write_flushed(writer, message, times)) for times in (100, 500)
    )
    writer.close()
    assert many[0] - few[0] < 100 * 400


@pytest.mark.usefixtures('short_files')
@pytest.mark.parametrize('times', [4, 20, 50])  # less than a file, all of one, several
def test_a_long_bag_goes_on_in_further_files(
    times: int, tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_flushed(writer, messages['reference'][0], times - 1)
    write_samples(writer, run, messages)
    writer.close()
    count = times - 1 + len(TOPICS) * len(run)
    files = sorted((tmp_path / 'bag').glob('*.mcap'))
    assert (len(files) > 1) == (times >= 20)
    text = (tmp_path / 'bag' / 'metadata.yaml').read_text()
    told = yaml.safe_load(text)['rosbag2_bagfile_information']
    assert told['relative_file_paths'] == [file.name for file in files]
    for file, entry in zip(files, told['files'], strict=True):
        with file.open('rb') as content:
            summary = make_reader(content).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert entry['path'] == file.name
        assert entry['message_count'] == summary.statistics.message_count
        first = entry['starting_time']['nanoseconds_since_epoch']
        assert first == summary.statistics.message_start_time
        assert first + entry['duration']['nanoseconds'] == summary.statistics.message_end_time
        assert len(summary.channels) == len(TOPICS) + 1
    with Reader(tmp_path / 'bag') as reader:
        assert reader.message_count == told['message_count'] == count
        assert sum(1 for _ in reader.messages()) == count
    bag = Bag(tmp_path / 'bag')
    assert sum(len(part) for batch in bag.batches() for part in batch.samples.values()) == count
    assert bag.notes == []


def test_files_change_nothing_in_the_figures(
    bag: Path,
    tmp_path: Path,
    run: Any,
    messages: dict[str, list[bytes]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(bag_writer, '_CHUNKS_IN_FILE', 2)
    writer = open_bag(tmp_path / 'bag')
    third = len(run) // 3
    for first in range(0, len(run), third):
        for key, (topic, _) in TOPICS.items():
            part = slice(first, first + third)
            writer.write(topic, zip(messages[key][part], run.stamp[part].tolist(), strict=True))
        writer.flush()
    writer.close()
    assert len(list((tmp_path / 'bag').glob('*.mcap'))) > 2
    expected, found = analyse(bag).result, analyse(tmp_path / 'bag').result
    for named in ('scenario', 'mode', 'stage'):
        del expected[named], found[named]  # the monitor's word, in one of them only
    assert found == expected


@pytest.mark.usefixtures('short_files')
def test_a_file_that_cannot_be_begun_ends_the_recording_in_order(
    tmp_path: Path, messages: dict[str, list[bytes]], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer = open_bag(tmp_path / 'bag')

    def refuse(*_: object) -> None:
        raise OSError(24, 'Too many open files')

    monkeypatch.setattr(ChunkFile, '__init__', refuse)
    with pytest.raises(BagError, match=r'cannot write the bag .*: too many open files'):
        write_flushed(writer, messages['reference'][0], 30)
    with pytest.raises(BagError, match='cannot finish the bag'):
        writer.close()
    bag = Bag(tmp_path / 'bag')
    found = sum(len(batch.samples['reference']) for batch in bag.batches())
    assert found == bag_writer._CHUNKS_IN_FILE - 1  # one for what opening keeps


@pytest.mark.usefixtures('short_files')
def test_killed_where_a_file_begins_nothing_is_lost(
    tmp_path: Path, messages: dict[str, list[bytes]]
) -> None:
    writer = open_bag(tmp_path / 'bag')
    write_flushed(writer, messages['reference'][0], 30)
    writer.close()
    (tmp_path / 'bag' / 'metadata.yaml').unlink()
    (tmp_path / 'bag' / 'bag_2.mcap').write_bytes(b'\x89MC')
    bag = Bag(tmp_path / 'bag')
    assert sum(len(batch.samples['reference']) for batch in bag.batches()) == 30
    assert any("'bag_2.mcap' is empty" in note for note in bag.notes)
