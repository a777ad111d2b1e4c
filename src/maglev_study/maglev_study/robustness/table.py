"""A campaign as one table: a row for each machine, law and experiment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maglev_model.axes import AXES, UNITS
from maglev_model.programs.optional import MissingLibraryError
from maglev_monitor.bag.columns import Table
from maglev_monitor.bag.export import write
from maglev_study.robustness.fleet import Campaign

_BY_AXIS = {
    'mean': 'mean |e|',
    'peak': 'greatest |e|',
    'rms': 'root mean square of e',
}


def table(campaign: Campaign) -> Table:
    """Verdicts, figures and what was drawn, as columns; what there is none of is NaN."""
    plan, flown = campaign.plan, campaign.flown
    columns: dict[str, NDArray[Any]] = {
        'machine': np.array([one.machine for one in flown], dtype=np.int64)
    }
    units, told = {'machine': ''}, {'machine': 'its number; 0 is the nominal one'}

    def add(name: str, values: list[Any], unit: str, description: str) -> None:
        columns[name], units[name], told[name] = np.array(values), unit, description

    machines = {
        (one.name, number): plan.draw(one, number)
        for one in plan.contestants
        for number in sorted({row.machine for row in flown})
    }
    mine = [machines[one.law, one.machine] for one in flown]
    for name in ('law', 'experiment', 'verdict', 'reason'):
        add(name, [getattr(one, name) for one in flown], '', name)
    add('seed', [one.plant.seed for one in mine], '', "the plant's own")
    for name, what in _BY_AXIS.items():
        for axis, (label, unit) in enumerate(zip(AXES, UNITS, strict=True)):
            values = [getattr(one, name)[axis] for one in flown]
            add(f'{name}_{label}', values, unit, f'{label}: {what}')
    add('overshoot', [one.overshoot for one in flown], '%', 'of a step')
    add('settling', [one.settling for one in flown], 's', 'of a step, to 0.1 mm or mrad')
    for name in dict.fromkeys(name for one in mine for name in one.drawn):
        add(name, [one.drawn.get(name, np.nan) for one in mine], '', 'as drawn')
    return Table(columns, units, told, ())


def write_table(campaign: Campaign, folder: Path) -> tuple[Path, str]:
    """Write it as parquet, or as csv where there is no pyarrow; the file, and a note on that.

    Raises OSError where it cannot be written.
    """
    found = table(campaign)
    try:
        path = folder / 'machines.parquet'
        write(found, path, 'parquet')
        return path, ''
    except MissingLibraryError as error:
        path = folder / 'machines.csv'
        write(found, path, 'csv')
        return path, str(error)
