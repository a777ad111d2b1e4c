"""Join the topics of a run by sample number, whatever the order of arrival, in bounded memory.

Rows come out in blocks aligned to multiples of the block size, so what is computed block by block
is the same, bit for bit, for a live run and for its bag. No ROS here.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import KEPT, TOPIC_TYPES
from maglev_monitor.metrics.decoding import Records, stamps

_COLUMNS = {
    'reference': ('phase', 'segment', 'reference', 'target'),
    'measurement': ('gap', 'x', 'z', 'late_samples'),
    'currents': ('direct_current', 'quadrature_current'),
    'controller': ('saturated', 'limited_by', 'mode'),
    'plant': ('state', 'thermal_load', 'own_length'),
}
_FIELDS = {'reference': 'position'}  # of messages, where a column is called otherwise


def _row_type() -> np.dtype[np.void]:
    columns: list[Any] = [(name, '<i8') for name in ('sequence', 'stamp', 'stage_time')]
    for key, names in _COLUMNS.items():
        columns.append((f'has_{key}', '?'))
        fields = {field.name: field for field in TOPIC_TYPES[key].fields}
        for column in names:
            field = fields[_FIELDS.get(column, column)]
            columns.append((column, field.kind, (field.length,) if field.length > 1 else ()))
    return np.dtype(columns)


ROW = _row_type()
"""One joined sample.

``sequence``; ``stamp`` and ``stage_time`` of the measurement, by the wall clock and by the stage's
[ns], the same in bags from before the stage had one; ``has_<topic>`` and the columns of each topic
(all zero where the topic has no message for this sample, but NaN ``own_length`` where none tells
it).
"""


_ABSENT = 4000  # a topic of which nothing has come within so many samples is none of the run's
_ON_ITS_WAY = 100  # a topic that is further behind than this has stopped [samples]


class Joiner:
    """Joins records of the five topics into rows by sample number.

    A block is handed out when every topic has gone past its end, or when the stage is ``window``
    samples past it (a topic that never comes, or has stopped, must not hold the rest back). Later
    arrivals for a block handed out already are dropped and counted.

    :param block: rows in a block.
    :param window: samples to wait for a topic that lags behind: by default all that its publisher
        keeps; for one of which nothing has come, 4000 at most.
    """

    def __init__(self, block: int = 500, window: int = KEPT['lockstep']) -> None:
        self._size = block
        self._window = window
        self._pending: dict[int, Records] = {}
        self._next = -1  # number of the first block not handed out yet, -1 before the first one
        self.newest = dict.fromkeys(TOPIC_TYPES, -1)
        """Highest sample number seen on each topic, -1 when there was none."""
        self.end: int | None = None
        """First sample of END in the reference, None while there is none."""
        self.dropped = 0

    def add(self, key: str, records: Records) -> None:
        """Take records of one topic, from :func:`~.samples.decode`, in any order."""
        if not len(records):
            return
        sequence = records['sequence'].astype(np.int64)
        numbers = sequence // self._size
        for number in np.unique(numbers).tolist():
            inside = np.flatnonzero(numbers == number)
            if number < self._next:
                self.dropped += len(inside)
            else:
                rows = sequence[inside] % self._size
                self._fill(self._block(number), key, rows, records[inside])
        if key == 'reference' and self.end is None:
            ends = sequence[records['phase'] == Phase.END]
            self.end = int(ends.min()) if len(ends) else None
        self.newest[key] = max(self.newest[key], int(sequence.max()))

    def take(self) -> Iterator[Records]:
        """Hand out complete blocks, in order: arrays of :data:`ROW`, shape (block,)."""
        stage = max(self.newest['measurement'], self.newest['currents'])
        absent = stage - min(self._window, _ABSENT)
        last = min(max(n, stage - self._window if n >= 0 else absent) for n in self.newest.values())
        while self._pending:
            number = min(self._pending)
            if (number + 1) * self._size - 1 > last:
                return
            yield self._hand_out(number)

    def finish(self) -> Iterator[Records]:
        """Hand out what is left, up to where the topics that still flow have all come.

        What is only on its way when a run is broken off, and a reference ahead of it, is not lost.
        """
        newest = [n for key, n in self.newest.items() if key != 'reference' and n >= 0]
        last = min((n for n in newest if n > max(newest) - _ON_ITS_WAY), default=-1)
        if self.end is not None and self.end <= max(newest, default=-1):
            last = max(last, self.end)
        while self._pending:
            block = self._hand_out(min(self._pending))
            block = block[: max(last - int(block['sequence'][0]) + 1, 0)]
            if len(block):
                yield block

    def _hand_out(self, number: int) -> Records:
        self._next = number + 1
        return self._pending.pop(number)

    def _block(self, number: int) -> Records:
        block = self._pending.get(number)
        if block is None:
            block = np.zeros(self._size, ROW)
            block['sequence'] = number * self._size + np.arange(self._size)
            block['own_length'] = np.nan
            self._pending[number] = block
        return block

    def _fill(self, block: Records, key: str, rows: np.ndarray, records: Records) -> None:
        block[f'has_{key}'][rows] = True
        sent = records.dtype.names or ()
        if key == 'measurement':
            block['stage_time'][rows] = stamps(records)
            block['stamp'][rows] = records['wall_time'] if 'wall_time' in sent else stamps(records)
        for column in _COLUMNS[key]:
            field = _FIELDS.get(column, column)
            if field in sent:
                block[column][rows] = records[field]
