"""Trajectories from CSV files: followed through every row, and refused with file and line."""

import math

import numpy as np
import pytest

from maglev_model.contract.phases import Phase
from maglev_model.parameters import ParameterError, build
from maglev_reference.parameters import ReferenceParameters
from maglev_reference.path_file import PathFile
from maglev_reference.timeline import Timeline
from maglev_reference.trajectory_parameters import FileParameters

HEADER = 't,y,x,z,phi,theta'
OMEGA = 2.0 * math.pi / 2.5


def figure(time):
    """The figure of eight of params/figure_of_eight.csv, with its derivatives."""
    offset = np.array([0.025, 0.0, 0.0, 0.0, 0.0])
    amplitude = np.array([0.003, 0.035, 0.025, 0.0, 0.003])
    frequency = OMEGA * np.array([1.0, 1.0, 2.0, 1.0, 1.0])
    angle = frequency * time[:, None] + np.array([0.5 * math.pi, 0.0, 0.0, 0.0, 0.0])
    return (
        offset + amplitude * np.sin(angle),
        amplitude * frequency * np.cos(angle),
        -amplitude * frequency**2 * np.sin(angle),
    )


def write(path, rows, header=HEADER):
    text = '\n'.join([header, *(','.join(f'{value:.12g}' for value in row) for row in rows)])
    path.write_text(text + '\n', encoding='utf-8')
    return path


def rows(count=126, spacing=0.02):
    time = spacing * np.arange(count)
    return np.column_stack((time, figure(time)[0]))


@pytest.fixture
def path(tmp_path):
    return tmp_path / 'path.csv'


def test_a_periodic_file_is_the_curve_it_samples(path):
    motion = PathFile(FileParameters(path=str(write(path, rows())), repeat=True))
    assert motion.length == pytest.approx(2.5)
    time = np.linspace(-3.0, 6.0, 1711)
    for values, wanted, bound in zip(
        motion.evaluate(time), figure(time), (1e-9, 1e-7, 1e-5), strict=True
    ):
        assert values == pytest.approx(wanted, abs=bound)


def test_a_file_begins_and_ends_at_rest_through_every_row(path):
    table = rows(60)
    motion = PathFile(FileParameters(path=str(write(path, table))))
    found = motion.evaluate(table[:, 0])
    assert found.position == pytest.approx(table[:, 1:], abs=1e-11)
    ends = motion.evaluate(np.array([-2.0, 0.0, motion.length, motion.length + 2.0]))
    assert ends.velocity == pytest.approx(0.0, abs=1e-12)
    assert ends.acceleration == pytest.approx(0.0, abs=1e-9)
    assert ends.position[0] == pytest.approx(table[0, 1:], abs=1e-12)
    assert ends.position[3] == pytest.approx(table[-1, 1:], abs=1e-12)


def test_comments_and_empty_lines_are_passed_over(path):
    write(path, rows())
    lines = path.read_text().splitlines()
    lines[1:1] = ['', '# between']
    path.write_text('\ufeff# first\n' + '\n'.join(lines))
    assert PathFile(FileParameters(path=str(path), repeat=True)).length == pytest.approx(2.5)


def test_a_file_is_followed_whole(path):
    ramp = rows(60)
    for axis in range(1, 6):
        s = ramp[:, 0] / ramp[-1, 0]
        way = (0.002, 0.02, -0.02, 0.0, 0.001)[axis - 1]
        ramp[:, axis] = (axis == 1) * 0.025 + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    parameters = build(
        ReferenceParameters,
        {
            'trajectory': 'file',
            'file.path': str(write(path, ramp)),
            'duration': 1.5,
            'run_in': 0.2,
        },
    )
    timeline = Timeline(parameters)
    block = timeline.block(0, timeline.end)
    track = block.phase == Phase.TRACK
    assert block.position[track][0] == pytest.approx(ramp[0, 1:], abs=1e-12)
    assert block.position[track][1180] == pytest.approx(ramp[-1, 1:], abs=1e-9)
    assert block.target[track][0] == pytest.approx(ramp[-1, 1:], abs=1e-9)


def cell(row, column, value):
    def change(lines):
        cells = lines[row].split(',')
        cells[column] = value
        lines[row] = ','.join(cells)
        return lines

    return change


def scaled(column, factor):
    def change(lines):
        for row in range(1, len(lines)):
            cells = lines[row].split(',')
            cells[column] = repr(factor * float(cells[column]))
            lines[row] = ','.join(cells)
        return lines

    return change


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        (cell(0, 5, 'psi'), "line 1: the columns are 't,y,x,z,phi,psi', they must be 't,y,x"),
        (lambda lines: lines[1:], 'line 1: the columns are'),
        (lambda lines: ['0' * 200_000], r'line 1: field larger than field limit'),
        (lambda lines: [], 'has 0 rows'),
        (lambda lines: lines[:8], 'has 7 rows, a trajectory needs at least 8'),
        (cell(17, 3, 'nan'), "line 18: z is 'nan', it must be a finite number"),
        (cell(17, 2, ''), "line 18: x is ''"),
        (cell(17, 4, 'inf'), "line 18: phi is 'inf'"),
        (cell(17, 4, '0,1'), 'line 18: 7 columns, there must be 6'),
        (scaled(2, 1e3), r'line 3: x is \S+ m; is it in mm'),
        (scaled(1, 1e3), r'line 2: y is 28 m; is it in mm'),
        (scaled(5, 1e3), r'theta is \S+ rad; is it in mrad'),
        (scaled(0, 1e3), 't rises by 20 s from row to row, at most 0.5 s; is it in ms'),
        (cell(50, 0, '0.985'), 'line 51: t is 0.025 s after the row before, others 0.02 s'),
        (lambda lines: [lines[0], *lines[:0:-1]], 't does not rise'),
        (lambda lines: lines[:-3], 'line 124: z is .* to repeat, the last row must be the first'),
    ],
)
def test_what_is_wrong_with_a_file_is_named(path, change, words):
    write(path, rows())
    path.write_text('\n'.join(change(path.read_text().splitlines())))
    with pytest.raises(ParameterError, match=words) as caught:
        PathFile(FileParameters(path=str(path), repeat=True))
    assert str(path) in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path, path):
    with pytest.raises(ParameterError, match=r"'file.path' must name a CSV file"):
        PathFile(FileParameters())
    with pytest.raises(ParameterError, match=r"cannot read .*path.csv': No such file"):
        PathFile(FileParameters(path=str(path)))
    with pytest.raises(ParameterError, match='cannot read'):
        PathFile(FileParameters(path=str(tmp_path)))
    path.write_bytes(b'\xff\xfe\x00\x81')
    with pytest.raises(ParameterError, match='no text file'):
        PathFile(FileParameters(path=str(path)))


def test_a_file_out_of_range_is_refused_with_its_time(path):
    table = rows()
    table[:, 2] *= 1.6
    parameters = build(
        ReferenceParameters,
        {
            'trajectory': 'file',
            'file.path': str(write(path, table)),
            'file.repeat': True,
            'duration': 3.0,
        },
    )
    with pytest.raises(ParameterError, match=r'x is -?0.05\d* m at \d+\.\d+ s'):
        Timeline(parameters)


def test_what_was_checked_is_flown_whatever_becomes_of_the_file(path):
    given = {'trajectory': 'file', 'file.path': str(write(path, rows())), 'duration': 2.5}
    parameters = build(ReferenceParameters, {**given, 'file.repeat': True})
    timeline = Timeline(parameters, autostart=False)
    checked = Timeline(parameters).block(0, 20_000).position
    table = rows()
    table[:, 2] *= 1.6
    write(path, table)
    assert timeline.lift_off(0, checked[0])
    np.testing.assert_array_equal(timeline.block(0, 20_000).position, checked)
    path.unlink()
    assert timeline.lift_off(20_000, checked[0])
