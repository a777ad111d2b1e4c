"""Metrics, recording, analysis and report of a run. No ROS but in the nodes of live/ and bag/."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas


def read(bag: str | Path) -> pandas.DataFrame:
    """The run in a bag as a DataFrame, one row a sample, its index the stage time [s].

    ``bag`` is a run's folder, a bag, or a bag's file; ``attrs['units']`` has the unit of each
    column. Raises ``BagError`` for what is no bag of a run, and ``MissingLibraryError`` where
    pandas is not installed. See docs/data.md.
    """
    from maglev_monitor.bag import export

    frame: pandas.DataFrame = export.read(bag)
    return frame
