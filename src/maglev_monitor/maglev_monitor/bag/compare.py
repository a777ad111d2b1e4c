"""Compare two bags sample by sample, in memory that does not grow with their length. No ROS here.

A sample's number says which samples belong together. What comes after the end of the run, in the
time it takes the nodes to leave, is not compared.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.contract.phases import Phase
from maglev_model.contract.wire import TOPIC_TYPES
from maglev_monitor.bag.reader import Bag, Batch
from maglev_monitor.metrics.decoding import Records

WALL_CLOCK = ('seconds', 'nanoseconds', 'late_samples', 'wall_time', 'session', 'controller')
"""Fields that two runs of the same thing need not share: when it was, and who sent it."""


@dataclasses.dataclass
class FieldDifference:
    """How one field differs: largest difference in SI units, first sample, number of samples."""

    largest: float
    first: int
    samples: int


@dataclasses.dataclass
class TopicComparison:
    """One topic in two bags: samples in both, numbers of those in one only, fields that differ.

    ``fields`` are those that messages of one have and the other's have not, which compares nothing.
    """

    both: int = 0
    only: tuple[list[int], list[int]] = dataclasses.field(default_factory=lambda: ([], []))
    differences: dict[str, FieldDifference] = dataclasses.field(default_factory=dict)
    fields: tuple[set[str], set[str]] = dataclasses.field(default_factory=lambda: (set(), set()))

    @property
    def equal(self) -> bool:
        """Whether nothing is missing and nothing differs by more than the tolerance."""
        return not (self.differences or any(self.only))


def compare(
    bags: tuple[Bag, Bag],
    topics: Collection[str] = tuple(TOPIC_TYPES),
    *,
    tolerance: float = 0.0,
    wall_clock: bool = False,
) -> dict[str, TopicComparison]:
    """Compare topics of two bags, by their keys in ``TOPIC_TYPES``; those in neither are left out.

    :param tolerance: differences up to this are none, in the SI units of the fields; 0: bit by bit.
    :param wall_clock: compare :data:`WALL_CLOCK` too.
    :raises BagError: when a bag cannot be read, or holds several runs.
    """
    keys = [key for key in TOPIC_TYPES if key in topics]
    comparisons = {key: TopicComparison() for key in keys}
    ignored = () if wall_clock else WALL_CLOCK
    sides = (_Side(bags[0]), _Side(bags[1]))
    while not all(side.exhausted for side in sides):
        behind = min((side for side in sides if not side.exhausted), key=lambda side: side.progress)
        behind.advance()
        end = max(side.end for side in sides)
        bound = min(side.newest('reference') for side in sides)
        for key in keys:
            upto = min(bound, *(side.newest(key) for side in sides))
            first, second = (_until(side.take(key, upto), end) for side in sides)
            _compare(comparisons[key], first, second, tolerance, ignored)
    return {key: result for key, result in comparisons.items() if result.both or any(result.only)}


class _Side:
    """One of the two bags, read as far as it is needed."""

    def __init__(self, bag: Bag) -> None:
        self._batches: Iterator[Batch] = bag.batches()
        self._waiting: dict[str, list[Records]] = {key: [] for key in TOPIC_TYPES}
        self._newest = dict.fromkeys(TOPIC_TYPES, -1)
        self.exhausted = False
        self.end = math.inf
        """First sample of END."""

    @property
    def progress(self) -> int:
        return max(self._newest.values())

    def advance(self) -> None:
        batch = next(self._batches, None)
        if batch is None:
            self.exhausted = True
            return
        for key, records in batch.samples.items():
            self._waiting[key].append(records)
            self._newest[key] = max(self._newest[key], int(records['sequence'].max()))
            if key == 'reference':
                ends = records['sequence'][records['phase'] == Phase.END]
                self.end = min(self.end, float(ends.min())) if len(ends) else self.end

    def newest(self, key: str) -> float:
        """Highest sample number of a topic; what is below it has come."""
        return math.inf if self.exhausted else self._newest[key]

    def take(self, key: str, upto: float) -> Records | None:
        """Samples below a number in order, of what comes twice the last."""
        parts = self._waiting[key]
        if not parts:
            return None
        records = parts[0] if len(parts) == 1 else np.concatenate(parts)
        below = records['sequence'] < upto
        self._waiting[key] = [records[~below]] if not below.all() else []
        taken = records[below][::-1]
        return taken[np.unique(taken['sequence'], return_index=True)[1]]


def _until(records: Records | None, end: float) -> Records | None:
    return records if records is None else records[records['sequence'] <= end]


def _compare(
    comparison: TopicComparison,
    first: Records | None,
    second: Records | None,
    tolerance: float,
    ignored: Collection[str],
) -> None:
    if first is None or second is None:
        for records, only in zip((first, second), comparison.only, strict=True):
            only.extend([] if records is None else records['sequence'].tolist())
        return
    numbers, left, right = np.intersect1d(
        first['sequence'], second['sequence'], assume_unique=True, return_indices=True
    )
    comparison.both += len(numbers)
    comparison.only[0].extend(np.delete(first['sequence'], left).tolist())
    comparison.only[1].extend(np.delete(second['sequence'], right).tolist())
    if not len(numbers):
        return
    names = [{*(side.dtype.names or ())}.difference(ignored) for side in (first, second)]
    comparison.fields[0].update(names[0] - names[1])
    comparison.fields[1].update(names[1] - names[0])
    for name in first.dtype.names or ():
        if name in names[0] & names[1]:
            difference = _difference(first[name][left], second[name][right], tolerance)
            _note(comparison, name, numbers, difference)


def _difference(first: NDArray[Any], second: NDArray[Any], tolerance: float) -> NDArray[Any]:
    """Largest difference of each sample, shape (n,): NaN where there is none.

    0 where only bits differ, as of 0 and -0; infinite where one is no number.
    """
    first, second = (np.ascontiguousarray(a).reshape(len(a), -1) for a in (first, second))
    bits = f'u{first.dtype.itemsize}'
    differs = first.view(bits) != second.view(bits)
    with np.errstate(invalid='ignore'):
        size = np.abs(first.astype(np.float64) - second.astype(np.float64))
    size[differs & np.isnan(size)] = np.inf
    if tolerance > 0.0:
        differs &= size > tolerance
    largest: NDArray[Any] = np.where(differs, size, -1.0).max(axis=1, initial=-1.0)
    return np.where(largest < 0.0, np.nan, largest)


def _note(
    comparison: TopicComparison, name: str, numbers: NDArray[Any], difference: NDArray[Any]
) -> None:
    differing = np.flatnonzero(~np.isnan(difference))
    if not len(differing):
        return
    largest = float(difference[differing].max())
    known = comparison.differences.get(name)
    if known is None:
        first = int(numbers[differing[0]])
        comparison.differences[name] = FieldDifference(largest, first, len(differing))
    else:
        known.largest = max(known.largest, largest)
        known.samples += len(differing)
