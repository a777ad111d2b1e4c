"""A run as columns, one row a sample: what they are called, their units, and where they come from.

No ROS here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, UNITS
from maglev_model.geometry import outputs_of_gaps
from maglev_model.programs.progress import Progress
from maglev_monitor.bag.analysis import run_parameters
from maglev_monitor.bag.errors import BagError
from maglev_monitor.bag.reader import Bag
from maglev_monitor.metrics.decoding import Records, joined, stage_period

NONE = -1
"""What a column of whole numbers holds at a sample whose message is missing; others hold NaN."""

# No fields of a message: the outputs y, x, z, phi, theta of the six encoders, and of their scales
_OUTPUT, _OWN = 'output', 'own_output'


class Column(NamedTuple):
    """One column: its name, its unit ('' for none) and what it is; topic key, field and element."""

    name: str
    unit: str
    description: str
    topic: str
    field: str
    element: int | None = None


def _by_axis(
    name: str, what: str, topic: str, field: str, per: str = '', at: tuple[int, int] = (0, 1)
) -> Iterator[Column]:
    for axis, (label, unit) in enumerate(zip(AXES, UNITS, strict=True)):
        element = at[0] + at[1] * axis
        yield Column(f'{name}_{label}', unit + per, f'{label}: {what}', topic, field, element)


def _by_motor(name: str, unit: str, what: str, topic: str, field: str) -> Iterator[Column]:
    for motor in range(4):
        yield Column(f'{name}_{motor + 1}', unit, f'motor {motor + 1}: {what}', topic, field, motor)


COLUMNS: tuple[Column, ...] = (
    Column('phase', '', 'what is wanted, a number of maglev_msgs/Reference', 'reference', 'phase'),
    Column('segment', '', 'segment of the reference', 'reference', 'segment'),
    *_by_axis('reference', 'where it shall be', 'reference', 'position'),
    *_by_axis('reference_velocity', 'its velocity', 'reference', 'velocity', '/s'),
    *_by_axis('reference_acceleration', 'its acceleration', 'reference', 'acceleration', '/s^2'),
    *_by_axis('target', "set-point at the segment's end", 'reference', 'target'),
    *_by_motor('gap', 'm', 'air gap as its encoder reads it', 'measurement', 'gap'),
    *_by_axis('measured', 'as the encoders have it', 'measurement', _OUTPUT),
    Column('late_samples', '', 'samples so far that were late', 'measurement', 'late_samples'),
    Column('wall_time', 'ns', 'wall clock, since the epoch', 'measurement', 'wall_time'),
    *_by_motor('direct_current', 'A', 'i_d commanded', 'currents', 'direct_current'),
    *_by_motor('quadrature_current', 'A', 'i_q commanded', 'currents', 'quadrature_current'),
    Column('mode', '', 'a number of maglev_msgs/ControllerState', 'controller', 'mode'),
    Column('limited_by', '', 'what limited the currents, bits', 'controller', 'limited_by'),
    *_by_axis('error', 'measured less reference', 'controller', 'error'),
    *_by_axis('error_rate', 'its rate as estimated', 'controller', 'error_rate', '/s'),
    *_by_axis('virtual_input', 'w, acceleration asked for', 'controller', 'virtual_input', '/s^2'),
    *_by_axis(
        'internal_model', "the internal model's part of w", 'controller', 'internal_model', '/s^2'
    ),
    *_by_axis('true', 'where it truly was', 'plant', 'state', at=(0, 2)),
    *_by_axis('own', "as the encoders' own scales have it, between counts", 'plant', _OWN),
    *_by_axis('true_velocity', 'its true velocity', 'plant', 'state', '/s', at=(1, 2)),
    *_by_motor('true_direct_current', 'A', 'i_d that flowed', 'plant', 'direct_current'),
    *_by_motor('true_quadrature_current', 'A', 'i_q that flowed', 'plant', 'quadrature_current'),
    *_by_motor('thermal_load', '', 'used share of its thermal budget', 'plant', 'thermal_load'),
)
"""All but the :data:`FIRST`; of a topic that a bag does not hold, there are none."""

FIRST: tuple[tuple[str, str, str], ...] = (
    ('sample', '', 'number of the sample, from 0 where the stage began'),
    ('time', 's', 'stage time since sample 0'),
)


@dataclasses.dataclass(frozen=True)
class Table:
    """A run: ``columns`` (n,) each by name, and their ``units`` and ``descriptions``; ``notes``.

    Notes say in plain lines what was wrong with the bag. One row a sample, in order; where a sample
    has no message of a topic, its columns hold NaN, those of whole numbers :data:`NONE`.
    """

    columns: dict[str, NDArray[Any]]
    units: dict[str, str]
    descriptions: dict[str, str]
    notes: tuple[str, ...]


def table(path: str | Path, progress: Progress | None = None) -> Table:
    """The run in a bag: a run's folder, a bag, or a bag's file; ``progress`` is told of it.

    Raises :class:`~.errors.BagError` when there is no bag, or nothing of a run in it.
    """
    bag = Bag(Path(path), progress)
    run, notes = run_parameters(bag)
    records = _records(bag)
    if not records:
        raise BagError(f"the bag '{bag.path}' holds no run: none of its topics")
    samples = _samples(records)
    measured = records.get('measurement')
    stage = None if measured is None else stage_period(measured)
    period = stage or run.sample_time
    units = {name: unit for name, unit, _ in FIRST}
    texts = {name: text for name, _, text in FIRST}
    found: dict[str, NDArray[Any]] = {'sample': samples, 'time': period * samples}
    rows = {key: np.searchsorted(samples, _numbers(part)) for key, part in records.items()}
    outputs = _outputs(records, run.machine.radius)
    for column in COLUMNS:
        part = records.get(column.topic)
        if column.field in outputs:
            values = outputs[column.field]
        elif part is not None and column.field in (part.dtype.names or ()):
            values = part[column.field]
        else:
            continue
        if column.element is not None:
            values = values[:, column.element]
        found[column.name] = _spread(values, rows[column.topic], len(samples))
        units[column.name], texts[column.name] = column.unit, column.description
    return Table(found, units, texts, (*bag.notes, *notes))


def _records(bag: Bag) -> dict[str, Records]:
    """The samples of each topic that the bag has, of each sample its last message, in order."""
    parts: dict[str, list[Records]] = {}
    for batch in bag.batches():
        for key, records in batch.samples.items():
            parts.setdefault(key, []).append(records)
    return {key: _in_order(joined(found)) for key, found in parts.items()}


def _numbers(records: Records) -> NDArray[np.int64]:
    numbers: NDArray[np.int64] = records['sequence'].astype(np.int64)
    return numbers


def _in_order(records: Records) -> Records:
    numbers = _numbers(records)
    _, last = np.unique(numbers[::-1], return_index=True)
    return records[len(numbers) - 1 - last]


def _samples(records: dict[str, Records]) -> NDArray[np.int64]:
    """Every sample of a topic; of the reference, which runs ahead, none beyond the others' last."""
    others = [_numbers(part) for key, part in records.items() if key != 'reference']
    if others and 'reference' in records:
        newest = max(int(numbers[-1]) for numbers in others)
        reference = records['reference']
        records['reference'] = reference[_numbers(reference) <= newest]
    samples: NDArray[np.int64] = np.unique(
        np.concatenate([_numbers(part) for part in records.values()])
    )
    return samples


def _outputs(records: dict[str, Records], radius: float) -> dict[str, NDArray[np.float64]]:
    found = {}
    if 'measurement' in records:
        part = records['measurement']
        found[_OUTPUT] = outputs_of_gaps(part['gap'], part['x'], part['z'], radius)
    if 'plant' in records and 'own_length' in (records['plant'].dtype.names or ()):
        own = records['plant']['own_length']
        found[_OWN] = outputs_of_gaps(own[:, :4], own[:, 4], own[:, 5], radius)
    return found


def _spread(values: NDArray[Any], rows: NDArray[np.int64], count: int) -> NDArray[Any]:
    """Values (m,) of some rows as a column (count,)."""
    whole = values.dtype.kind in 'iub'
    column = np.full(count, NONE, np.int64) if whole else np.full(count, np.nan)
    column[rows] = values
    return column
