"""A run as columns: what they hold, how they are written, and that the page knows them all."""

from __future__ import annotations

import builtins
import csv
import os
import re
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_up_run import TOPICS, open_bag
from run_figures import figures
from scipy.io import loadmat

import maglev_monitor
from maglev_model.axes import AXES
from maglev_model.programs.optional import MissingLibraryError
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.analysis import analyse
from maglev_monitor.bag.columns import COLUMNS, FIRST, NONE, Table, table
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.export import FORMATS, write
from maglev_monitor.bag.export_cli import DONE, FAILED, export
from maglev_monitor.metrics.decoding import decode

PAGE = Path(__file__).resolve().parents[3] / 'docs' / 'data.md'
NAMES = [name for name, _, _ in FIRST] + [column.name for column in COLUMNS]


@pytest.fixture(scope='module')
def whole(bag: Path) -> Table:
    return table(bag)


def test_the_columns_are_the_runs(whole: Table, run: Any) -> None:
    n = len(run)
    assert list(whole.columns) == NAMES == list(whole.units) == list(whole.descriptions)
    assert {len(column) for column in whole.columns.values()} == {n}
    np.testing.assert_array_equal(whole.columns['sample'], np.arange(n))
    np.testing.assert_allclose(whole.columns['time'], 1e-3 * np.arange(n), rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(whole.columns['phase'], run.phase)
    np.testing.assert_array_equal(whole.columns['limited_by'], run.limited_by)
    np.testing.assert_array_equal(whole.columns['wall_time'], run.stamp)
    for axis, name in enumerate(AXES):
        np.testing.assert_array_equal(whole.columns[f'reference_{name}'], run.reference[:, axis])
        np.testing.assert_array_equal(whole.columns[f'target_{name}'], run.target[:, axis])
        np.testing.assert_array_equal(whole.columns[f'true_{name}'], run.position[:, axis])
        np.testing.assert_array_equal(whole.columns[f'true_velocity_{name}'], 0.1)
        assert np.abs(whole.columns[f'measured_{name}'] - run.position[:, axis]).max() < 1e-12
    np.testing.assert_array_equal(whole.columns['reference_velocity_z'], 1.0)
    np.testing.assert_array_equal(whole.columns['reference_acceleration_z'], 2.0)
    for motor in range(4):
        np.testing.assert_array_equal(whole.columns[f'gap_{motor + 1}'], run.gap[:, motor])
        commanded = whole.columns[f'quadrature_current_{motor + 1}']
        np.testing.assert_array_equal(commanded, run.quadrature[:, motor])
    assert whole.units['virtual_input_theta'] == 'rad/s^2'
    assert whole.units['true_velocity_x'] == 'm/s'
    assert whole.notes == ()


def test_how_far_the_text_is_written_is_told(whole: Table, tmp_path: Path) -> None:
    told: list[tuple[float, float]] = []

    class Told(Progress):
        def tell(self, done: float, wanted: float, words: str = '') -> None:
            told.append((done, wanted))

    write(whole, tmp_path / 'run.csv', 'csv', Told('export', '%'))
    length = len(whole.columns['sample'])
    assert told[-1] == (length, length)


def test_what_a_bag_does_not_hold(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    """No plant, as on hardware; a reference that runs ahead; holes; messages twice."""
    writer = open_bag(tmp_path / 'bag')
    kept = {key: list(part[:200]) for key, part in messages.items() if key != 'plant'}
    kept['reference'] = messages['reference'][:264]
    del kept['currents'][50:60], kept['measurement'][70]
    kept['controller'].append(kept['controller'][-1])
    for key, part in kept.items():
        writer.write(TOPICS[key][0], [(data, int(run.stamp[0])) for data in part])
    writer.close()
    found = table(tmp_path).columns
    assert not [name for name in found if name.startswith(('true_', 'thermal'))]
    np.testing.assert_array_equal(found['sample'], np.arange(200))
    missing = np.isnan(found['direct_current_1'])
    np.testing.assert_array_equal(np.flatnonzero(missing), np.arange(50, 60))
    assert np.flatnonzero(found['late_samples'] == NONE).tolist() == [70]
    assert np.flatnonzero(np.isnan(found['measured_y'])).tolist() == [70]
    assert not np.isnan(found['error_y']).any()


def test_a_bag_without_a_monitor_goes_by_the_time_of_the_stage(
    tmp_path: Path, run: Any, messages: dict[str, list[bytes]]
) -> None:
    """300 Hz, of a stage that was taken down for ten seconds."""
    period, pause = 3_333_333, 10_000_000_000
    writer = open_bag(tmp_path / 'bag')
    for key, part in messages.items():
        for n, data in enumerate(part):
            stamp = divmod(int(run.stamp[0]) + n * period + pause * (n > 700), 1_000_000_000)
            stamped = data[:4] + struct.pack('<iI', *stamp) + data[12:]
            writer.write(TOPICS[key][0], [(stamped, int(run.stamp[n]))])
    writer.close()
    assert table(tmp_path).columns['time'][-1] == pytest.approx(1e-9 * period * (len(run) - 1))
    steps, slower = analyse(tmp_path).result['steps'], 1e-6 * period
    usual = figures({key: decode(key, part) for key, part in messages.items()})['steps']
    for found, wanted in zip(steps, usual, strict=True):
        assert found['settling_time'] == pytest.approx(slower * wanted['settling_time'])


def test_the_standard_output_is_no_file(
    bag: Path, tmp_path: Path, capsys: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert export([str(bag), '--out', '-']) == FAILED
    assert capsys.readouterr().err == "export: error: '-' is no file, and no run goes to a pipe\n"
    assert not list(tmp_path.iterdir())


def test_what_is_no_run_is_refused(tmp_path: Path, capsys: Any) -> None:
    with pytest.raises(BagError, match='there is no bag'):
        table(tmp_path / 'nothing')
    assert export([str(tmp_path / 'nothing')]) == FAILED
    assert capsys.readouterr().err.startswith("export: error: there is no bag '")


def exported(bag: Path, folder: Path, form: str) -> Path:
    """The file that the command writes."""
    out = folder / f'run.{form}'
    assert export([str(bag), '--format', form, '--out', str(out)]) == DONE
    assert not list(folder.glob('*.tmp'))
    return out


def test_csv_reads_back_exactly(bag: Path, whole: Table, tmp_path: Path, capsys: Any) -> None:
    with exported(bag, tmp_path, 'csv').open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == NAMES
    for name, texts in zip(NAMES, zip(*rows[1:], strict=True), strict=True):
        np.testing.assert_array_equal(
            np.array(texts, whole.columns[name].dtype), whole.columns[name]
        )
    with (tmp_path / 'run_columns.csv').open() as file:
        described = list(csv.DictReader(file))
    assert [row['column'] for row in described] == NAMES
    assert described[NAMES.index('gap_2')] == {
        'column': 'gap_2',
        'unit': 'm',
        'description': 'motor 2: air gap as its encoder reads it',
    }
    assert f'{len(rows) - 1} samples, {len(NAMES)} columns' in capsys.readouterr().out


def test_nothing_stands_for_what_is_missing(whole: Table, tmp_path: Path) -> None:
    gone = {**whole.columns, 'gap_1': np.full(len(whole.columns['sample']), np.nan)}
    holes = Table(gone, whole.units, whole.descriptions, ())
    write(holes, tmp_path / 'run.csv', 'csv')
    with (tmp_path / 'run.csv').open() as file:
        assert {row['gap_1'] for row in csv.DictReader(file)} == {''}


def test_npz_and_mat(bag: Path, whole: Table, tmp_path: Path) -> None:
    with np.load(exported(bag, tmp_path, 'npz')) as npz:
        assert npz['names'].tolist() == NAMES
        assert dict(zip(NAMES, npz['units'].tolist(), strict=True)) == whole.units
        for name in NAMES:
            np.testing.assert_array_equal(npz[name], whole.columns[name])
    mat = loadmat(exported(bag, tmp_path, 'mat'))
    for name in NAMES:
        np.testing.assert_array_equal(mat[name][:, 0], whole.columns[name])
        assert mat[name].shape[1] == 1
    assert mat['units']['direct_current_1'][0, 0].tolist() == ['A']


def test_parquet(bag: Path, whole: Table, tmp_path: Path) -> None:
    parquet = pytest.importorskip('pyarrow.parquet', reason='pyarrow comes with the test tools')
    found = parquet.read_table(exported(bag, tmp_path, 'parquet'))
    assert found.column_names == NAMES
    assert found.schema.field('error_y').metadata[b'unit'] == b'm'
    for name in NAMES:
        np.testing.assert_array_equal(found[name].to_numpy(), whole.columns[name])


def test_the_format_is_that_of_the_file_s_name(bag: Path, tmp_path: Path) -> None:
    assert export([str(bag), '--out', str(tmp_path / 'run.npz')]) == DONE
    with np.load(tmp_path / 'run.npz') as npz:
        assert npz['names'].tolist() == NAMES
    assert export([str(bag), '--out', str(tmp_path / 'run.txt')]) == DONE
    assert (tmp_path / 'run.txt').read_text().startswith('sample,time,')


def test_it_goes_beside_the_bag(bag: Path, tmp_path: Path) -> None:
    (tmp_path / 'bag').symlink_to(bag)
    assert export([str(tmp_path), '--format', 'npz']) == DONE
    assert (tmp_path / 'samples.npz').is_file()


def test_a_place_that_cannot_be_written(bag: Path, tmp_path: Path, capsys: Any) -> None:
    out = tmp_path / 'nowhere' / 'run.npz'
    assert export([str(bag), '--format', 'npz', '--out', str(out)]) == FAILED
    assert f"cannot write '{out}': No such file" in capsys.readouterr().err


@pytest.mark.parametrize('name', ['pipe', '.'])
def test_what_is_no_file_is_not_replaced(
    name: str, bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo('pipe')
    assert export([str(bag), '--format', 'npz', '--out', name]) == FAILED
    assert f"cannot write '{name}': it is there and is no file" in capsys.readouterr().err
    assert Path('pipe').is_fifo()


def test_a_data_frame_in_one_line(bag: Path, whole: Table) -> None:
    pytest.importorskip('pandas', reason='pandas comes with the test tools')
    frame = maglev_monitor.read(bag)
    assert list(frame.columns) == [name for name in NAMES if name != 'time']
    assert frame.index.name == 'time'
    np.testing.assert_array_equal(frame.index, whole.columns['time'])
    np.testing.assert_array_equal(frame['true_y'], whole.columns['true_y'])
    assert frame.attrs['units']['true_y'] == 'm'


@pytest.mark.parametrize(
    ('library', 'why'),
    [
        ('pandas', f'read needs pandas: {sys.executable} -m pip install pandas'),
        (
            'pyarrow',
            f"the format parquet needs pyarrow: {sys.executable} -m pip install 'pyarrow<26'",
        ),
    ],
)
def test_a_library_that_is_not_there_is_named(
    library: str, why: str, bag: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    there = builtins.__import__

    def without(name: str, *others: Any) -> Any:
        if name.partition('.')[0] == library:
            raise ModuleNotFoundError(name)
        return there(name, *others)

    monkeypatch.setattr(builtins, '__import__', without)
    if library == 'pandas':
        with pytest.raises(MissingLibraryError) as error:
            maglev_monitor.read(bag)
        assert str(error.value) == why
    else:
        out = tmp_path / 'run.parquet'
        assert export([str(bag), '--format', 'parquet', '--out', str(out)]) == FAILED
        assert capsys.readouterr().err == f'export: error: {why}\n'
        assert not list(tmp_path.iterdir())


def test_the_page_knows_every_column_and_format() -> None:
    text = PAGE.read_text(encoding='utf-8')
    named: set[str] = set()
    for cell in re.findall(r'^\| (`[^|]*`) \|', text.partition('## The columns')[2], re.MULTILINE):
        for name in re.findall('`(.*?)`', cell):
            axes = [name.replace('AXIS', axis) for axis in AXES] if 'AXIS' in name else [name]
            for one in axes:
                named |= {one.replace('MOTOR', motor) for motor in '1234'}
    assert named == set(NAMES)
    assert set(
        re.findall(r'^\| `(\w+)` \|', text.partition('## The columns')[0], re.MULTILINE)
    ) == set(FORMATS)
