"""The comparison as a table of text and as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence

import numpy as np

from maglev_model.axes import AXES
from maglev_study.comparison.experiments import Row
from maglev_study.comparison.region import LOST, NOT_SETTLED, Region


def table(rows: Mapping[str, Sequence[Row]], regions: Mapping[str, Sequence[Region]]) -> str:
    """One column for each law, one line for each experiment."""
    laws = list(rows)
    sections: list[tuple[str, str, list[str]]] = [
        (row.section, row.title, [rows[law][index].text for law in laws])
        for index, row in enumerate(rows[laws[0]])
    ]
    for index, region in enumerate(regions[laws[0]]):
        title = f'{AXES[region.axis]} steps'
        shares = [share(regions[law][index]) for law in laws]
        sections.append(('region of operation: survived, settled', title, shares))
    first = max(len(title) for _, title, _ in sections) + 2
    widths = [
        max(len(law), *(len(cells[column]) for _, _, cells in sections)) + 2
        for column, law in enumerate(laws)
    ]
    lines = [' ' * first + ''.join(f'{law:>{w}}' for law, w in zip(laws, widths, strict=True))]
    section = ''
    for name, title, cells in sections:
        if name != section:
            section = name
            lines += ['', name]
        figures = ''.join(f'{cell:>{w}}' for cell, w in zip(cells, widths, strict=True))
        lines.append(f'{"  " + title:<{first}}' + figures)
    return '\n'.join(lines)


def share(region: Region) -> str:
    """How many of a region's steps were survived, and settled."""
    tried = region.settling[~np.isnan(region.settling)]
    if tried.size == 0:
        return '-'
    survived = float(np.mean(tried != LOST))
    settled = float(np.mean((tried != LOST) & (tried != NOT_SETTLED)))
    return f'{100 * survived:.0f} %, {100 * settled:.0f} %'


def to_json(
    rows: Mapping[str, Sequence[Row]], regions: Mapping[str, Sequence[Region]], facts: object
) -> str:
    """All figures; what is infinite or not a number in the table is null."""
    content = {
        'facts': facts,
        'experiments': {
            law: [
                {**vars(row), 'values': [v if math.isfinite(v) else None for v in row.values]}
                for row in found
            ]
            for law, found in rows.items()
        },
        'regions': {
            law: [
                {
                    'axis': AXES[region.axis],
                    'gap': region.gap.tolist(),
                    'size': region.size.tolist(),
                    'settling': [[_outcome(v) for v in line] for line in region.settling],
                }
                for region in found
            ]
            for law, found in regions.items()
        },
    }
    return json.dumps(content, indent=1, allow_nan=False)


def _outcome(value: float) -> float | str | None:
    if math.isnan(value):
        return None
    if value == LOST:
        return 'lost'
    return 'unsettled' if value == NOT_SETTLED else float(value)
