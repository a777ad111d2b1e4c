"""A trajectory from a CSV file.

The first line names the columns, ``t,y,x,z,phi,theta``, in s, m and rad; then one row per instant,
at least eight, equally spaced by at most 0.5 s. Empty lines and lines that begin with # are passed
over. Between the rows runs a quintic spline through all of them, from which velocity and
acceleration come: it begins and ends at rest, or is periodic when the file repeats, whose last row
must then be its first again. Values should have all their digits: rounding shows in the
acceleration.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from maglev_model.axes import AXES, UNITS, FloatArray
from maglev_model.parameters import ParameterError
from maglev_reference.motion import Kinematics
from maglev_reference.trajectory_parameters import FileParameters

COLUMNS = ('t', *AXES)
_ROWS = 8
_SPACING = 0.5  # [s]
_SPACING_TOLERANCE = 0.01  # of it
_LARGEST = 0.2  # no output of such a machine gets there [m, rad]
_CLOSED = 1e-6  # how near a repeating file comes to its beginning [m, rad]


class PathFile:
    """The motion a file gives; it stands before and after it, or repeats after ``length`` [s].

    Raises ParameterError, naming file and line, for a file that is missing or not as described.
    """

    def __init__(self, parameters: FileParameters) -> None:
        if not parameters.path:
            raise ParameterError("parameter 'file.path' must name a CSV file")
        path = Path(parameters.path)
        table, lines = read_table(path)
        position = table[:, 1:]
        self.length = float(table[-1, 0] - table[0, 0])
        self.repeats = parameters.repeat
        time = np.linspace(0.0, self.length, len(table))
        if self.repeats:
            _check_closed(position, path, lines[-1])
            position[-1] = position[0]
            boundary: object = 'periodic'
        else:
            rest = [(order, np.zeros(5)) for order in (1, 2)]
            boundary = (rest, rest)
        spline = make_interp_spline(time, position, k=5, bc_type=boundary)
        self._orders = (spline, spline.derivative(1), spline.derivative(2))

    def evaluate(self, time: FloatArray) -> Kinematics:
        """Position, velocity and acceleration at each time (n,) [s]."""
        inside = np.mod(time, self.length) if self.repeats else np.clip(time, 0.0, self.length)
        return Kinematics(*(np.ascontiguousarray(order(inside)) for order in self._orders))


def read_table(path: Path) -> tuple[FloatArray, list[int]]:
    """The rows t, y, x, z, phi, theta (n, 6) of a file and the line each stands on.

    Raises ParameterError as :class:`PathFile`.
    """
    try:
        text = path.read_text(encoding='utf-8-sig')
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, 'strerror', None) or 'it is no text file'
        raise ParameterError(f"cannot read the trajectory file '{path}': {reason}") from error
    rows: list[list[float]] = []
    lines: list[int] = []
    header: list[str] | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip() or line.lstrip().startswith('#'):
            continue
        cells = _cells(line, path, number)
        if header is None:
            header = cells
            _check_header(header, path, number)
        else:
            rows.append(_row(cells, path, number))
            lines.append(number)
    if len(rows) < _ROWS:
        raise ParameterError(f"'{path}' has {len(rows)} rows, a trajectory needs at least {_ROWS}")
    table = np.array(rows)
    _check_units(table, path, lines)
    _check_spacing(table[:, 0], path, lines)
    return table, lines


def _cells(line: str, path: Path, number: int) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:  # as of a file that is none of rows
        raise ParameterError(f"'{path}' line {number}: {error}") from error


def _check_header(header: Iterable[str], path: Path, line: int) -> None:
    if tuple(header) != COLUMNS:
        raise ParameterError(
            f"'{path}' line {line}: the columns are '{','.join(header)}', they must be "
            f"'{','.join(COLUMNS)}'"
        )


def _row(cells: list[str], path: Path, line: int) -> list[float]:
    if len(cells) != len(COLUMNS):
        raise ParameterError(
            f"'{path}' line {line}: {len(cells)} columns, there must be {len(COLUMNS)}"
        )
    values = []
    for name, cell in zip(COLUMNS, cells, strict=True):
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise ParameterError(
                f"'{path}' line {line}: {name} is '{cell}', it must be a finite number"
            )
        values.append(value)
    return values


def _check_units(table: FloatArray, path: Path, lines: list[int]) -> None:
    large = np.argwhere(np.abs(table[:, 1:]) > _LARGEST)
    if large.size:
        row, axis = large[0]
        raise ParameterError(
            f"'{path}' line {lines[row]}: {AXES[axis]} is {table[row, axis + 1]:g} {UNITS[axis]}; "
            f'is it in m{UNITS[axis]}? Positions are in m, angles in rad'
        )


def _check_spacing(time: FloatArray, path: Path, lines: list[int]) -> None:
    spacing = np.diff(time)
    wanted = float(np.median(spacing))
    if not wanted > 0.0:
        raise ParameterError(f"'{path}': t does not rise from row to row")
    if wanted > _SPACING:
        raise ParameterError(
            f"'{path}': t rises by {wanted:g} s from row to row, at most {_SPACING:g} s; "
            'is it in ms?'
        )
    uneven = np.flatnonzero(np.abs(spacing - wanted) > _SPACING_TOLERANCE * wanted)
    if uneven.size:
        row = uneven[0] + 1
        raise ParameterError(
            f"'{path}' line {lines[row]}: t is {spacing[uneven[0]]:g} s after the row before, "
            f'others {wanted:g} s; rows must be equally spaced'
        )


def _check_closed(position: FloatArray, path: Path, line: int) -> None:
    apart = np.abs(position[-1] - position[0])
    axis = int(np.argmax(apart))
    if apart[axis] > _CLOSED:
        raise ParameterError(
            f"'{path}' line {line}: {AXES[axis]} is {position[-1, axis]:g} {UNITS[axis]}, the "
            f'first row has {position[0, axis]:g}; to repeat, the last row must be the first again'
        )
