"""A run written as csv, parquet, mat or npz. No ROS here."""

from __future__ import annotations

import csv
import errno
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from maglev_model.programs.optional import needed
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.columns import Table, table
from maglev_monitor.metrics.result_file import whole

_ROWS = 10_000  # of text that is made at once


def read(path: str | Path) -> Any:
    """The run in a bag as a ``pandas.DataFrame``, its index the stage time [s].

    One row a sample; ``attrs`` holds ``units`` and ``descriptions`` by column, and ``notes`` on the
    bag. Raises :class:`~.errors.BagError` for what is no bag of a run, and
    :class:`~maglev_model.programs.optional.MissingLibraryError` without pandas.
    """
    with needed('pandas', 'read'):
        import pandas
    found = table(path)
    frame = pandas.DataFrame(found.columns).set_index('time')
    frame.attrs = {
        'units': dict(found.units),
        'descriptions': dict(found.descriptions),
        'notes': list(found.notes),
    }
    return frame


def write(found: Table, path: Path, form: str, progress: Progress | None = None) -> list[Path]:
    """Write a run, or another table, in one of :data:`FORMATS`; returns the files.

    They take their place when whole; how far csv is, which takes long, ``progress`` is told. Raises
    OSError where it cannot be written, as in place of a device, and :class:`MissingLibraryError`.
    """
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, 'it is there and is no file')
    with whole(path) as partial:
        FORMATS[form](found, partial, progress)
    if form != 'csv':
        return [path]
    described = path.with_name(f'{path.stem}_columns.csv')
    described.write_text(_described(found), encoding='utf-8')
    return [path, described]


def _described(found: Table) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator='\n')
    rows.writerow(('column', 'unit', 'description'))
    rows.writerows((name, found.units[name], found.descriptions[name]) for name in found.columns)
    return text.getvalue()


def _csv(found: Table, path: Path, progress: Progress | None) -> None:
    """Numbers that read back exactly, nothing where there is none."""
    with path.open('w', encoding='utf-8') as file:
        file.write(','.join(found.columns) + '\n')
        length = len(next(iter(found.columns.values())))
        for first in range(0, length, _ROWS):
            texts = [_texts(column[first : first + _ROWS]) for column in found.columns.values()]
            file.writelines(','.join(row) + '\n' for row in zip(*texts, strict=True))
            if progress:
                progress.tell(min(first + _ROWS, length), length)


def _texts(values: Any) -> list[str]:
    if values.dtype.kind == 'f':
        return ['' if value != value else repr(value) for value in values.tolist()]
    if values.dtype.kind == 'U':
        return ['"' + value.replace('"', '""') + '"' for value in values.tolist()]
    return [str(value) for value in values.tolist()]


def _npz(found: Table, path: Path, _: Progress | None) -> None:
    """The columns, and ``names``, ``units`` and ``descriptions`` in their order."""
    content: dict[str, Any] = {**found.columns, 'names': list(found.columns)}
    content['units'] = list(found.units.values())
    content['descriptions'] = list(found.descriptions.values())
    with path.open('wb') as file:
        np.savez_compressed(file, **content)


def _mat(found: Table, path: Path, _: Progress | None) -> None:
    """The columns as column vectors, and the structs ``units`` and ``descriptions``."""
    from scipy.io import savemat

    content = {**found.columns, 'units': found.units, 'descriptions': found.descriptions}
    with path.open('wb') as file:
        savemat(file, content, do_compression=True, oned_as='column')


def _parquet(found: Table, path: Path, _: Progress | None) -> None:
    """The columns, each with its unit and description in its field's metadata."""
    with needed('pyarrow', 'the format parquet', '<26'):  # later ones need NumPy 2
        import pyarrow
        import pyarrow.parquet
    fields = [
        pyarrow.field(
            name,
            pyarrow.from_numpy_dtype(column.dtype),
            metadata={'unit': found.units[name], 'description': found.descriptions[name]},
        )
        for name, column in found.columns.items()
    ]
    columns = list(found.columns.values())
    whole = pyarrow.table(columns, schema=pyarrow.schema(fields))
    pyarrow.parquet.write_table(whole, path)


FORMATS: dict[str, Callable[[Table, Path, Progress | None], None]] = {
    'csv': _csv,
    'parquet': _parquet,
    'mat': _mat,
    'npz': _npz,
}
"""What writes each format."""
