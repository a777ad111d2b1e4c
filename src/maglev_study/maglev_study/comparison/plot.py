"""The picture of the regions of operation. The only module here that needs Matplotlib."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from maglev_study.comparison.region import LOST, NOT_SETTLED, Region

_NAMES = ('y step [mm]', 'x step [mm]', 'z step [mm]', 'phi step [mrad]', 'theta step [mrad]')
_LOST, _UNSETTLED = '#b0392b', '#c9c9c9'
_SPAN = 0.01, 5.0  # of the colours [s]


def draw_regions(regions: Mapping[str, list[Region]], path: Path) -> None:
    """One column for each law, one row for each axis; the format is by the path's suffix."""
    rows = max(len(found) for found in regions.values())
    figure = Figure(figsize=(3.0 * len(regions) + 1.5, 3.2 * rows + 0.6), layout='constrained')
    panels = figure.subplots(rows, len(regions), squeeze=False)
    mesh: Any = None
    for column, (name, found) in enumerate(regions.items()):
        panels[0][column].set_title(name.replace('_', ' '))
        for row, region in enumerate(found):
            drawn = _panel(panels[row][column], region)
            mesh = drawn if drawn is not None else mesh
    if mesh is not None:
        figure.colorbar(mesh, ax=panels, label='settles to 0.1 mm or mrad in [s]', shrink=0.6)
    figure.legend(
        handles=[
            Patch(color=_LOST, label='lost: meets a stop'),
            Patch(color=_UNSETTLED, label='survives, not settled in 5 s'),
            Patch(facecolor='white', edgecolor='black', label='no such step, or not controlled'),
        ],
        loc='outside lower center',
        ncols=3,
        frameon=False,
    )
    figure.savefig(path, dpi=110)


def _panel(axes: Any, region: Region) -> Any:
    settling = region.settling
    columns, rows = np.arange(region.size.size), region.gap * 1e3
    for mark, colour in ((LOST, _LOST), (NOT_SETTLED, _UNSETTLED)):
        here = np.where(settling == mark, 1.0, np.nan)
        axes.pcolormesh(columns, rows, here, cmap=ListedColormap([colour]), shading='nearest')
    settled = np.where(np.isfinite(settling) & (settling >= 0.0), settling, np.nan)
    mesh = None
    if np.isfinite(settled).any():
        shown, norm = np.clip(settled, *_SPAN), LogNorm(*_SPAN)
        mesh = axes.pcolormesh(columns, rows, shown, cmap='viridis_r', norm=norm, shading='nearest')
    ticks = columns[:: max(1, len(columns) // 7)]
    axes.set_xticks(ticks, [f'{1e3 * region.size[tick]:g}' for tick in ticks])
    axes.set_xlabel(_NAMES[region.axis])
    axes.set_ylabel('air gap at the start [mm]')
    return mesh
